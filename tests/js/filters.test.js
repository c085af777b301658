import { hasAll } from "../../iveg/static/js/pages/filters.js";
import { equal, test } from "./harness.js";

test("a row is found by all words of a search, whatever accents and capitals", () => {
  const row = "24/11 10:11 AGII PARAR Sustituida por otra; rearmó el operador";
  equal(hasAll(row, "agii Rearmo"), true);
  equal(hasAll(row, "  "), true);
  equal(hasAll(row, "agii reanudar"), false);
});
