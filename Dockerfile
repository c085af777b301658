# iVeg as an image: libraries from the hashed lock files, then the code, no build tools,
# a user without rights, nothing to write to but /data and /tmp.
#
# Two targets: `server` (the last, hence the usual one) carries the product alone;
# `laboratory` adds iveg/lab, for `iveg emulator`.

FROM python:3.12.11-slim-bookworm@sha256:519591d6871b7bc437060736b9f7456b8731f1499a57e22e6c285135ae657bf7 AS libraries
WORKDIR /build
COPY requirements/image.lock requirements/audit.lock ./
RUN python -m venv /opt/iveg \
    && /opt/iveg/bin/pip install --no-cache-dir --disable-pip-version-check \
        --require-hashes -r image.lock
# What is inside, as CycloneDX, told by a tool that does not come along.
RUN python -m venv /build/audit \
    && /build/audit/bin/pip install --no-cache-dir --disable-pip-version-check \
        --require-hashes -r audit.lock \
    && /build/audit/bin/cyclonedx-py environment --output-reproducible \
        --output-file /opt/iveg/sbom.cdx.json /opt/iveg/bin/python

# Compiled here: the file system is read-only later.
FROM python:3.12.11-slim-bookworm@sha256:519591d6871b7bc437060736b9f7456b8731f1499a57e22e6c285135ae657bf7 AS code
WORKDIR /app
COPY iveg iveg
COPY migrations migrations
RUN python -m compileall -q iveg migrations && mv iveg/lab /lab

FROM python:3.12.11-slim-bookworm@sha256:519591d6871b7bc437060736b9f7456b8731f1499a57e22e6c285135ae657bf7 AS product
RUN groupadd --gid 10001 iveg \
    && useradd --uid 10001 --gid iveg --no-create-home --shell /usr/sbin/nologin iveg \
    && install --directory --owner iveg --group iveg --mode 700 /data
COPY --from=libraries /opt/iveg /opt/iveg
WORKDIR /app
COPY --from=code /app /app
ENV PATH=/opt/iveg/bin:$PATH PYTHONPATH=/app PYTHONUNBUFFERED=1 \
    XDG_DATA_HOME=/data HOME=/tmp IVEG_HOST=0.0.0.0 PYTHONDONTWRITEBYTECODE=1
USER 10001:10001
VOLUME /data
EXPOSE 8000
ENTRYPOINT ["python", "-m", "iveg"]

FROM product AS laboratory
COPY --from=code /lab /app/iveg/lab
CMD ["emulator"]

FROM product AS server
CMD ["serve"]
