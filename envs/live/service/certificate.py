"""A certificate made on the spot: browsers give a headset's hands to secure pages only."""

import shutil
import ssl
import subprocess
from pathlib import Path

from mjx_hand.errors import InputError

_DAYS = 30


def secure_context(folder: Path, host: str) -> ssl.SSLContext:
    """TLS with a key and a certificate that nobody has vouched for; browsers ask whether to go on.

    Args:
        folder: for the two files; keep it private, and delete it afterwards.
        host: the name or address that the certificate is for.

    Raises:
        InputError: the program `openssl` is not installed, or fails.
    """
    program = shutil.which("openssl")
    if program is None:
        raise InputError(
            "HTTPS needs the program openssl to make a certificate; install it, or stay on this computer (--host "
            "127.0.0.1) and connect the headset by USB"
        )
    key, certificate = folder / "key.pem", folder / "certificate.pem"
    kind = "IP" if host.replace(".", "").isdigit() or ":" in host else "DNS"
    command = [program, "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes"]
    command += ["-days", str(_DAYS), "-subj", "/CN=mjx-hand live", "-addext", f"subjectAltName={kind}:{host}"]
    command += ["-keyout", str(key), "-out", str(certificate)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        reason = (done.stderr.strip().splitlines() or ["no word why"])[-1]
        raise InputError(f"openssl made no certificate for {host} ({reason}); try openssl 1.1.1 or newer")
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificate, key)
    return context
