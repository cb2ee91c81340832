"""Draw the door's own page: one stop button that needs no script and no other file."""

import hashlib
from base64 import b64encode
from html import escape
from typing import Final

_STYLE: Final = """
:root { color-scheme: light dark; font: 1.25rem/1.5 system-ui, sans-serif; }
body { margin: 0; min-height: 100vh; display: grid; place-content: center; gap: 1.5rem;
  padding: 1rem; box-sizing: border-box; text-align: center; }
button { width: min(80vmin, 24rem); aspect-ratio: 1; border: 1rem solid #ffd400;
  border-radius: 50%; background: #b00020; color: #fff; font: bold 4rem system-ui, sans-serif; }
button:focus-visible { outline: .5rem solid Highlight; outline-offset: .25rem; }
"""
_PAGE: Final = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Stop the robot</title>
<style>{style}</style>
</head>
<body>
<main>
<h1>{heading}</h1>
<form method="post" action="/stop"><button autofocus>STOP</button></form>
<p role="status">{told}</p>
</main>
</body>
</html>
"""
STYLE_DIGEST: Final = b64encode(hashlib.sha256(_STYLE.encode()).digest()).decode()
"""What the content security policy admits the page's style by."""


def stop_page(heading: str, told: str) -> str:
    """Return the page with a heading and a line below the button."""
    return _PAGE.format(style=_STYLE, heading=escape(heading), told=escape(told))
