# iVeg as an image: libraries from the hashed lock files, then the code, no build tools,
# a user without rights, nothing to write to but /data and /tmp.

FROM python:3.12.11-slim-bookworm AS libraries
WORKDIR /build
COPY requirements/run.lock requirements/dev.lock ./
# PostgreSQL's driver is locked among the developers' libraries; only it is taken.
RUN awk '/^[^ #]/ { wanted = /^psycopg/ } wanted' dev.lock > postgresql.lock \
    && python -m venv /opt/iveg \
    && /opt/iveg/bin/pip install --no-cache-dir --disable-pip-version-check \
        --require-hashes -r run.lock -r postgresql.lock

FROM python:3.12.11-slim-bookworm
RUN groupadd --gid 10001 iveg \
    && useradd --uid 10001 --gid iveg --no-create-home --shell /usr/sbin/nologin iveg \
    && install --directory --owner iveg --group iveg --mode 700 /data
COPY --from=libraries /opt/iveg /opt/iveg
WORKDIR /app
COPY iveg iveg
COPY migrations migrations
ENV PATH=/opt/iveg/bin:$PATH PYTHONPATH=/app PYTHONUNBUFFERED=1 \
    XDG_DATA_HOME=/data HOME=/tmp IVEG_HOST=0.0.0.0
# Compiled now: the file system is read-only later.
RUN python -m compileall -q iveg migrations
ENV PYTHONDONTWRITEBYTECODE=1
USER 10001:10001
VOLUME /data
EXPOSE 8000
ENTRYPOINT ["python", "-m", "iveg"]
CMD ["serve"]
