/** The layout of a frame in bytes, below the meaning of its fields. */

/** A frame that does not follow the contract; the connection goes on without it. */
export class ProtocolError extends Error {
  /** @param {string} fact */
  constructor(fact) {
    super(`unreadable frame: ${fact}`);
    this.name = "ProtocolError";
  }
}

const text = new TextDecoder();

/**
 * The JSON that a binary frame begins with, and where its body starts.
 *
 * Little-endian, as every browser's hardware is: `uint32` length of the head, then the
 * head, padded to a multiple of four.
 *
 * @param {ArrayBuffer} bytes
 * @returns {{head: any, start: number}}
 * @throws {ProtocolError}
 */
export function readHead(bytes) {
  if (bytes.byteLength < 4) throw new ProtocolError("shorter than its length field");
  const length = new DataView(bytes).getUint32(0, true);
  const start = 4 + length;
  if (start > bytes.byteLength) throw new ProtocolError("head longer than the frame");
  if (length % 4) throw new ProtocolError("head not padded to four bytes");
  const head = parse(text.decode(new Uint8Array(bytes, 4, length)));
  return { head, start };
}

/** @param {string} json */
export function parse(json) {
  try {
    return JSON.parse(json);
  } catch {
    throw new ProtocolError("not JSON");
  }
}
