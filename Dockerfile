# docker build -t hli-cosim .
# docker run --rm -v "$PWD:/work" hli-cosim run part.nc
FROM python:3.13-slim AS build
RUN apt-get update && apt-get install -y --no-install-recommends gcc libc6-dev \
    && rm -rf /var/lib/apt/lists/*
COPY . /source
RUN pip wheel --no-cache-dir -w /wheels "/source[pictures]"

FROM python:3.13-slim
RUN --mount=type=bind,from=build,source=/wheels,target=/wheels \
    pip install --no-cache-dir --no-index --find-links /wheels "hli-cosim[pictures]"
WORKDIR /work
ENTRYPOINT ["hli-cosim"]
