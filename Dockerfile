# The program on Debian slim with a software Vulkan driver.
#
#     docker build -t etendue .
#     docker run --rm -v "$PWD:/scenes" etendue render scene.toml
FROM rust:1.95-slim-trixie AS build
WORKDIR /source
COPY . .
RUN cargo build --locked --profile dist

FROM debian:trixie-slim
# The newest driver is wanted, whatever its version.
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install -y --no-install-recommends libvulkan1 mesa-vulkan-drivers \
    && rm -rf /var/lib/apt/lists/*
COPY --from=build /source/target/dist/etendue /usr/local/bin/etendue
# Where compiled kernels are kept: with --user there is no home.
ENV XDG_CACHE_HOME=/tmp
WORKDIR /scenes
ENTRYPOINT ["etendue"]
CMD ["--help"]
