"""Links to other sites, against a server of our own."""

import http.server
import socket
import threading

import pytest

from hydro_tools.repository import ROOT
from hydro_tools.site import external
from hydro_tools.site.pages import linked


class Handler(http.server.BaseHTTPRequestHandler):
    """Answers with the status that the path names."""

    def do_GET(self):
        self.send_response(int(self.path.strip("/").split("?")[0]))
        self.end_headers()

    def log_message(self, *_):
        pass


@pytest.fixture
def site():
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()


def test_what_is_gone_is_listed_with_its_page(site, tmp_path, monkeypatch):
    monkeypatch.setenv("no_proxy", "127.0.0.1")
    tmp_path.joinpath("a.md").write_text(
        f"[one]({site}/200#part), <{site}/404>. See {site}/403, and {site}/200?q=(a).\n"
    )
    links = external.external(tmp_path, ["a.md", "picture.webp"])
    assert list(links) == [f"{site}/200#part", f"{site}/200?q=(a)", f"{site}/403", f"{site}/404"]
    found = external.check(links)
    assert found.gone == [f"{site}/404"] and found.unknown == {f"{site}/403": "403"} and not found.is_offline
    assert f"gone: {site}/404  in a.md" in str(found)
    assert str(found).startswith("4 links to other sites: 1 gone, 1 without an answer")


def test_without_a_network_nothing_is_gone(tmp_path, monkeypatch):
    monkeypatch.setenv("no_proxy", "127.0.0.1")
    with socket.socket() as nobody:
        nobody.bind(("127.0.0.1", 0))
        link = f"http://127.0.0.1:{nobody.getsockname()[1]}/x"
        found = external.check({link: "a.md"})
    assert found.is_offline and found.gone == [] and "no network: none of 1 links" in str(found)


def test_the_pages_have_links():
    links = external.external(ROOT, linked(ROOT))
    assert len(links) > 50 and all("." in link and not link.endswith((".", ")")) or "(" in link for link in links)
