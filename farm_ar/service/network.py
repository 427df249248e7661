"""Where the service listens: sockets, the address on the local network, certificates and the QR code."""

from __future__ import annotations

import datetime as dt
import hashlib
import io
import ipaddress
import os
import socket
import ssl
from pathlib import Path
from typing import NamedTuple

from farm_ar.errors import OptionError
from farm_ar.scenes.files import whole_file
from farm_ar.service.refusals import missing_package

VALID_DAYS = 800
"""How long a certificate of ours is valid; some systems refuse more than 825 days."""

RENEW_DAYS = 30
"""How long before its end it is made anew."""


class Certificate(NamedTuple):
    """A certificate and its key as files, and the SHA-256 of it by which clients pin it."""

    certificate: Path
    key: Path
    pin: str


def listening(host: str, port: int) -> socket.socket:
    """A socket that listens.

    Raises:
        OptionError: the port cannot be had.
    """
    # By name, as asyncio sends at once (no Nagle, no 40 ms) only where it reads that it is TCP.
    found = socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        found.bind((host, port))
        found.listen(1024)
    except OSError as problem:
        found.close()
        raise OptionError("port", f"must be free ({problem.strerror})", port) from None
    found.set_inheritable(False)
    return found


def lan_address() -> str:
    """This machine's address on the local network; nothing is sent to find it."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asked:
        try:
            asked.connect(("10.255.255.255", 1))
            return str(asked.getsockname()[0])
        except OSError:
            return "127.0.0.1"


def self_signed(folder: Path, address: str) -> Certificate:
    """A certificate of the service's own, made once and kept, so that clients can pin it.

    Args:
        folder: where it is kept; the key is readable for its owner only.
        address: that it is for, beside this machine itself.
    """
    certificate, key = folder / "certificate.pem", folder / "key.pem"
    if not (certificate.exists() and key.exists() and _lasts(certificate)):
        _make(certificate, key, address)
    return Certificate(certificate, key, pin_of(certificate))


def pin_of(certificate: Path) -> str:
    """The SHA-256 of a certificate, as pairs of digits between colons.

    Raises:
        OptionError: the file is none.
    """
    try:
        der = ssl.PEM_cert_to_DER_cert(_first(certificate.read_text(encoding="ascii")))
    except (OSError, ValueError) as problem:
        raise OptionError("cert", f"must be a certificate in PEM ({problem})", str(certificate)) from None
    return pin_of_der(der)


def pin_of_der(der: bytes) -> str:
    """The SHA-256 of a certificate in DER."""
    digest = hashlib.sha256(der).hexdigest().upper()
    return ":".join(digest[i : i + 2] for i in range(0, len(digest), 2))


def check_pair(certificate: Path, key: Path) -> None:
    """See that a key is a certificate's.

    Raises:
        OptionError: it is not, or cannot be read, or needs a password.
    """

    def refuse() -> str:
        raise OptionError("key", "must be without a password", str(key))

    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(certificate, key, refuse)
    except (OSError, ValueError) as problem:
        if isinstance(problem, OptionError):
            raise
        raise OptionError("key", f"must be the certificate's, in PEM ({problem})", str(key)) from None


def qr_code(text: str) -> str:
    """A QR code in blocks of text, for a terminal."""
    try:
        import segno
    except ImportError:
        raise missing_package("segno") from None
    out = io.StringIO()
    segno.make(text, error="l").terminal(out=out, compact=True)
    return out.getvalue()


def _first(text: str) -> str:
    """The first certificate of a chain."""
    end = "-----END CERTIFICATE-----"
    return text[text.find("-----BEGIN CERTIFICATE-----") : text.find(end) + len(end)]


def _lasts(certificate: Path) -> bool:
    """Whether a certificate is valid for some time."""
    from cryptography import x509

    try:
        end = x509.load_pem_x509_certificate(certificate.read_bytes()).not_valid_after_utc
    except ValueError:
        return False
    return end - dt.datetime.now(dt.UTC) > dt.timedelta(days=RENEW_DAYS)


def _make(certificate: Path, key: Path, address: str) -> None:
    try:
        from cryptography import x509
        from cryptography.hazmat.primitives import hashes, serialization
        from cryptography.hazmat.primitives.asymmetric import ec
        from cryptography.x509.oid import NameOID
    except ImportError:
        raise missing_package("cryptography") from None
    secret = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "farm-ar")])
    now = dt.datetime.now(dt.UTC)
    places = {ipaddress.ip_address(address), ipaddress.ip_address("127.0.0.1")}
    names = [x509.DNSName("localhost"), *(x509.IPAddress(place) for place in sorted(places, key=str))]
    made = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(secret.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - dt.timedelta(days=1))
        .not_valid_after(now + dt.timedelta(days=VALID_DAYS))
        .add_extension(x509.SubjectAlternativeName(names), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .sign(secret, hashes.SHA256())
    )
    pem = serialization.Encoding.PEM
    plain = secret.private_bytes(pem, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    with whole_file(key) as temporary:
        handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        os.write(handle, plain)
        os.close(handle)
    with whole_file(certificate) as temporary:
        temporary.write_bytes(made.public_bytes(pem))
