"""The viewer for a browser elsewhere: whoever has the link gets page and data, nobody else gets anything."""

from __future__ import annotations

import http.client
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import psutil
import pytest

from tests.runs import POLE, evolve
from tests.terminal import REPOSITORY

READ = "/rerun.cloud.v1alpha1.RerunCloudService/Version"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("served") / "r"
    evolve(directory, POLE, "algorithm.population=2", "algorithm.generations=1")
    return directory


@contextmanager
def served(run: Path, *arguments: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    command = [sys.executable, "-m", "sceann_hil.cli", "view", str(run), *arguments, "--serve", "--port", "0"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, cwd=REPOSITORY)
    try:
        assert process.stderr is not None
        lines: list[str] = []
        while not (found := re.search(r"http://\S+", "".join(lines))):
            lines.append(process.stderr.readline())
            assert lines[-1], lines
        yield process, found[0]
    finally:
        process.kill()
        process.wait(20)
        # rerun's servers end with it, however it ends
        deadline = time.monotonic() + 20.0
        while _viewers_of(run) and time.monotonic() < deadline:
            time.sleep(0.1)
        assert not _viewers_of(run)


def _viewers_of(run: Path) -> list[str]:
    """Rerun's servers that still serve a recording of this run."""
    lines = [path.read_bytes() for path in Path("/proc").glob("[0-9]*/cmdline") if path.exists()]
    shown = [line.replace(b"\0", b" ").decode(errors="replace") for line in lines]
    return [line for line in shown if "--serve-web" in line and str(run) in line and "keeper" not in line]


def ask(link: str, path: str, cookie: str = "", method: str = "GET") -> tuple[int, bytes, http.client.HTTPMessage]:
    connection = http.client.HTTPConnection("127.0.0.1", urlsplit(link).port, timeout=60)
    headers = {"Cookie": cookie, "Host": urlsplit(link).netloc}
    if method == "POST":
        headers |= {"Content-Type": "application/grpc-web+proto", "X-Grpc-Web": "1"}
    connection.request(method, path, b"\0\0\0\0\0" if method == "POST" else None, headers)
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer.status, body, answer.headers


@pytest.mark.parametrize("arguments", [["--run"], []], ids=["overview", "gallery"])
def test_the_link_opens_page_and_data_and_nothing_else_does(run: Path, arguments: list[str]) -> None:
    with served(run, *arguments) as (process, link):
        for path, method in (("/", "GET"), ("/re_viewer_bg.wasm", "GET"), (READ, "POST"), ("/?t=wrong", "GET")):
            assert ask(link, path, method=method)[0] == 403
        status, _, headers = ask(link, f"/?{urlsplit(link).query}")
        assert status == 303
        cookie = headers["Set-Cookie"].partition(";")[0]
        assert {"HttpOnly", "SameSite=Strict"} <= set(headers["Set-Cookie"].split("; "))
        where = parse_qs(urlsplit(headers["Location"]).query)["url"][0]
        assert where.startswith(f"rerun+http://{urlsplit(link).netloc}/")
        assert "t=" not in headers["Location"].replace("&url=", "")
        status, page, headers = ask(link, headers["Location"], cookie)
        assert (status, b"Rerun" in page) == (200, True)
        assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
        assert len(ask(link, "/re_viewer_bg.wasm", cookie)[1]) > 1_000_000
        status, _, headers = ask(link, READ, cookie, "POST")
        assert status == 200
        assert headers["Content-Type"].startswith("application/grpc-web") or "grpc-status" in headers
        children = psutil.Process(process.pid).children(recursive=True)
        assert children
        process.send_signal(signal.SIGTERM)
        assert process.wait(60) == 0
        assert psutil.wait_procs(children, timeout=20)[1] == []


def test_a_port_in_use_is_told(run: Path) -> None:
    with served(run, "--run") as (_, link):
        port = str(urlsplit(link).port)
        command = [sys.executable, "-m", "sceann_hil.cli", "view", str(run), "--run", "--serve", "--port", port]
        done = subprocess.run(command, capture_output=True, text=True, cwd=REPOSITORY)
        assert done.returncode == 43, done.stderr
        assert "cannot be opened" in done.stderr
