# docker build -t crownfit . && docker run --rm -v "$PWD":/data crownfit fit CAPTURE -o RESULT
FROM debian:12-slim AS build
COPY . /crownfit
WORKDIR /crownfit
RUN ./dev package

FROM debian:12-slim
COPY --from=build /crownfit/build/release/crownfit_*.deb /tmp/
# Add libegl1, libgl1 and libgl1-mesa-dri for `crownfit view --screenshot`.
RUN apt-get update -q \
 && apt-get install -q -y --no-install-recommends /tmp/crownfit_*.deb \
 && rm -rf /var/lib/apt/lists/* /tmp/crownfit_*.deb
WORKDIR /data
ENTRYPOINT ["crownfit"]
CMD ["--help"]
