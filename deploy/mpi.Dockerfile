# The programs, with intervale-mpi and Open MPI, for deploy/k8s/build. The image of Dockerfile comes first:
#   docker build -f deploy/Dockerfile -t intervale .
#   docker build -f deploy/mpi.Dockerfile -t intervale-mpi .
FROM debian:bookworm AS build
# Those of deploy/packages that building requires.
RUN apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
      build-essential ca-certificates ccache cmake flatbuffers-compiler flatbuffers-compiler-dev libboost1.81-dev libbz2-dev libcli11-dev libcurl4-openssl-dev libegl-dev \
      libexpected-dev libflatbuffers-dev libfmt-dev libgles-dev libopenmpi-dev libpng-dev libpugixml-dev libspdlog-dev libssl-dev libtbb-dev libxxhash-dev libzstd-dev ninja-build \
      nlohmann-json3-dev pkg-config prometheus-cpp-dev zlib1g-dev \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /source
COPY . .
ARG JOBS
RUN --mount=type=cache,target=/root/.cache/ccache \
    cmake --preset release -DINTERVALE_TESTS=OFF -DINTERVALE_LIBRARIES=OFF -DINTERVALE_VIEWER=OFF -DINTERVALE_MPI=ON -DCMAKE_INSTALL_PREFIX=/opt/intervale \
    && cmake --build --preset release -j "${JOBS:-$(nproc)}" --target intervale-mpi \
    && cmake --install build/release --component mpi --strip \
    && rm -rf build

FROM intervale
USER root
# Ranks reach each other through an ssh server that is not root's.
RUN apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends openmpi-bin openssh-client openssh-server \
    && rm -rf /var/lib/apt/lists/* \
    && mkdir -p /home/intervale && chown 10001:10001 /home/intervale && usermod --home /home/intervale --shell /bin/sh intervale \
    && printf 'StrictHostKeyChecking no\nUserKnownHostsFile /dev/null\nPort 2222\n' >> /etc/ssh/ssh_config \
    && printf 'Port 2222\nPidFile /home/intervale/sshd.pid\nHostKey /home/intervale/.ssh/id_rsa\nStrictModes no\nUsePAM no\nPasswordAuthentication no\nSetEnv PATH=/opt/intervale/bin:/usr/bin:/bin\n' > /home/intervale/.sshd_config
COPY --from=build /opt/intervale/libexec /opt/intervale/libexec
# If a library is missing, the build fails here, and not the first start.
RUN ! ldd /opt/intervale/libexec/intervale/intervale-mpi | grep "not found"
USER 10001:10001
ENTRYPOINT []
CMD ["/usr/sbin/sshd", "-De", "-f", "/home/intervale/.sshd_config"]
