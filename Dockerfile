# ilg-circuit with all extras and ngspice; pinned versions, checked by their hashes.
#
#   docker build -t ilg-circuit .
#   docker run --rm -v "$PWD:/data" --user "$(id -u):$(id -g)" ilg-circuit identify step.csv --actuator strip.toml

FROM node:22-bookworm-slim AS page
COPY scripts/get_page_assets.py /src/scripts/
COPY ilg_circuit/browser /src/ilg_circuit/browser
RUN apt-get update && apt-get install -y --no-install-recommends ca-certificates python3 \
  && python3 /src/scripts/get_page_assets.py

FROM python:3.13-slim-bookworm
RUN apt-get update && apt-get install -y --no-install-recommends libngspice0 && rm -rf /var/lib/apt/lists/*
COPY constraints/all.txt /tmp/constraints.txt
RUN pip install --no-cache-dir --require-hashes -r /tmp/constraints.txt
COPY . /src
COPY --from=page /src/ilg_circuit/browser/assets /src/ilg_circuit/browser/assets
RUN pip install --no-cache-dir --no-deps --no-build-isolation /src && rm -rf /src && ilg-circuit doctor
# matplotlib, numba and fontconfig keep caches; whoever runs it may have no home
ENV HOME=/tmp MPLCONFIGDIR=/tmp/matplotlib NUMBA_CACHE_DIR=/tmp/numba
WORKDIR /data
ENTRYPOINT ["ilg-circuit"]
CMD ["--help"]
