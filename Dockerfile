# iccm as a command: docker run --rm -v "$PWD:/work" iccm map a.svg b.svg
FROM python:3.12-slim AS build
COPY . /source
# The compiler comes from PyPI, since the image has none. Tests of libraries are of no use in an image.
RUN python -m venv /opt/iccm \
    && /opt/iccm/bin/pip install --no-cache-dir /source \
    && /opt/iccm/bin/pip uninstall --yes pip \
    && find /opt/iccm -type d \( -name tests -o -name __pycache__ \) -prune -exec rm -rf {} +

FROM python:3.12-slim
COPY --from=build /opt/iccm /opt/iccm
ENV PATH=/opt/iccm/bin:$PATH PYTHONDONTWRITEBYTECODE=1
RUN useradd --create-home iccm
USER iccm
WORKDIR /work
ENTRYPOINT ["iccm"]
