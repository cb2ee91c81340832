"""Play the Hugging Face hub on loopback."""

import contextlib
import hashlib
import json
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any


class Hub:
    """Serve one repository as the Hugging Face hub does: what it holds, then files of a commit."""

    SHA = "0123456789012345678901234567890123456789"

    def __init__(self, folder: Path, under: str) -> None:
        files = {path.name: path.read_bytes() for path in folder.iterdir()}
        self.files = {f"{under}/{name}" if under else name: data for name, data in files.items()}
        self.files["README.md"] = b"not asked for"
        self.asked: list[str] = []
        self.url = ""
        self.wrong_hash_of = ""

    @property
    def fetched(self) -> list[str]:
        return [path for path in self.asked if not path.startswith("/api/")]

    def answer(self, path: str) -> bytes:
        """Return what the hub has at a path: the document of the repository, or a file."""
        self.asked.append(path)
        if not path.startswith("/api/"):
            return self.files[path.partition(f"/resolve/{self.SHA}/")[2]]
        siblings = [self._sibling(name, data) for name, data in self.files.items()]
        card = {"license": "mit"}
        told = {"id": "a/b", "sha": self.SHA, "siblings": siblings, "cardData": card}
        return json.dumps(told).encode()

    def _sibling(self, name: str, data: bytes) -> dict[str, Any]:
        blob = hashlib.sha1(b"blob %d\0" % len(data) + data).hexdigest()
        told: dict[str, Any] = {"rfilename": name, "size": len(data), "blobId": blob}
        if name.endswith((".bin", ".onnx")):
            digest = hashlib.sha256(data + b"x" * name.endswith(self.wrong_hash_of or "\0"))
            told["lfs"] = {"sha256": digest.hexdigest(), "size": len(data), "pointerSize": 130}
        return told


@contextlib.contextmanager
def served(hub: Hub) -> Iterator[str]:
    """Serve a repository, and yield the address."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            body = hub.answer(self.path)
            self.send_response(200)
            kind = "json" if self.path.startswith("/api/") else "octet-stream"
            self.send_header("Content-Type", f"application/{kind}")
            self.send_header("Content-Length", str(len(body)))
            self.send_header("X-Repo-Commit", hub.SHA)
            self.send_header("ETag", f'"{hashlib.sha256(body).hexdigest()}"')
            self.end_headers()
            if self.command == "GET":
                self.wfile.write(body)

        do_HEAD = do_GET  # noqa: N815 - http.server's name

        def log_message(self, *args: Any) -> None:
            """Say nothing on the terminal."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, args=(0.01,))
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    thread.join()
    server.server_close()
