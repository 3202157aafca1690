"""Compressed TIFF pictures, decoded in a separate process.

Pillow passes compressed pictures to libtiff, which prints complaints to standard error and has no setting
against that. Standard error belongs to the whole process, so another process decodes: this file, as a
program.
"""

from __future__ import annotations

import io
import subprocess
import sys


def unpack_tiff(data: bytes) -> bytes:
    """The first picture of a compressed TIFF, upright and without compression. Raises ValueError."""
    command = [sys.executable, "-P", __file__]
    done = subprocess.run(command, input=data, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=False)
    if done.returncode:
        raise ValueError(done.stdout.decode("utf-8", "replace") or "the decoder died")
    return done.stdout


def main() -> int:
    """Print the result of `unpack_tiff`, or the error's message with exit code 1 if decoding fails."""
    from PIL import Image, ImageOps

    decoded = io.BytesIO()
    try:
        image = Image.open(io.BytesIO(sys.stdin.buffer.read()), formats=("TIFF",))
        ImageOps.exif_transpose(image).save(decoded, "TIFF", compression="raw")
    except Exception as error:  # noqa: BLE001 - damaged pictures make decoders raise nearly anything
        sys.stdout.buffer.write((str(error) or type(error).__name__).encode("utf-8", "replace"))
        return 1
    sys.stdout.buffer.write(decoded.getvalue())
    return 0


if __name__ == "__main__":
    sys.exit(main())
