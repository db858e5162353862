# Debian 12 with psidpd, LAMMPS and the pair styles: docker build -t psidpd . && docker run --rm -v "$PWD:/out" psidpd
# runs `psidpd validate`, with its report in the folder of the call. The sources stay, for the plugin is compiled from them.
FROM rust:1.95.0-slim-bookworm
# Debian keeps no older versions to pin.
# hadolint ignore=DL3008
RUN apt-get update \
 && DEBIAN_FRONTEND=noninteractive apt-get install -qy --no-install-recommends g++ python3-venv \
 && rm -rf /var/lib/apt/lists/*
WORKDIR /psidpd
COPY . .
RUN cargo install --locked --path validation --target-dir target \
 && psidpd lammps install \
 && psidpd lammps plugin
ENTRYPOINT ["psidpd"]
CMD ["validate", "--out", "/out/validate"]
