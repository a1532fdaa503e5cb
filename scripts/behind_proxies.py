"""Looks at the page through proxies; scripts/behind-proxies fetches what it needs.

    behind_proxies.py PROGRAM NGINX BROWSER             an empty name: there is none

Exit status 1 if something does not come through.
"""

import http.client
import importlib.util
import json
import pathlib
import socket
import subprocess
import sys
import tempfile
import time
import urllib.parse

ROOT = pathlib.Path(__file__).resolve().parent.parent
SIZE = [48, 32]
SAMPLES = 64


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def until(what, known, seconds=60):
    """What `known` returns, once it is something."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        found = known()
        if found:
            return found
        time.sleep(0.1)
    sys.exit(f"behind_proxies.py: no {what} after {seconds} s")


def get(address, path):
    """Status, headers and body."""
    to = urllib.parse.urlsplit(urllib.parse.urljoin(address, path))
    connection = http.client.HTTPConnection(to.hostname, to.port, timeout=20)
    connection.request("GET", to.path + (f"?{to.query}" if to.query else ""))
    answer = connection.getresponse()
    return answer.status, answer.headers, answer.read()


def answers(address):
    """Whether anyone is at an address already."""
    try:
        return get(address, "")[0] == 200
    except OSError:
        return False


def first_event(address):
    """The first event of the stream, which must come although the stream goes on."""
    to = urllib.parse.urlsplit(urllib.parse.urljoin(address, "events"))
    connection = http.client.HTTPConnection(to.hostname, to.port, timeout=20)
    connection.request("GET", to.path, headers={"Accept": "text/event-stream"})
    answer = connection.getresponse()
    assert answer.headers["content-type"].startswith("text/event-stream"), answer.headers
    while True:
        line = answer.readline().decode()
        assert line, "the events end"
        if line.startswith("data: "):
            connection.close()
            return json.loads(line[6:])


def in_a_browser(address, browser):
    """Waits until the page's scripts have asked through the proxy, and drawn what they got."""
    # It reads calls from file 3 and writes answers to file 4, each with a NUL at its end.
    shell = 'exec "$0" "$@" 3<&0 4>&1 >/dev/null 2>&1 </dev/null'
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        flags = ["--headless=new", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe", f"--user-data-dir={profile}"]
        command = ["sh", "-c", shell, browser, *flags, "about:blank"]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:

            def call(method, session=None, **params):
                call = {"id": 1, "method": method, "params": params} | ({"sessionId": session} if session else {})
                child.stdin.write(json.dumps(call).encode() + b"\0")
                child.stdin.flush()
                while True:
                    answer = b""
                    while not answer.endswith(b"\0"):
                        byte = child.stdout.read(1)
                        assert byte, "the browser has ended"
                        answer += byte
                    answer = json.loads(answer[:-1])
                    if answer.get("id") == 1:
                        return answer["result"]

            try:
                target = call("Target.createTarget", url=address)["targetId"]
                session = call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
                drawn = f"document.getElementById('samples')?.textContent === '{SAMPLES}' && Boolean(view.whole)"
                evaluate = lambda: call("Runtime.evaluate", session, expression=drawn)["result"].get("value")
                until("picture in the browser", evaluate)
            finally:
                child.kill()


def look(name, address, browser):
    """Asks for everything that the page asks for, and opens it in a browser."""
    begun = time.monotonic()
    status, headers, page = get(address, "")
    assert status == 200 and b"<title>etendue</title>" in page, (status, page[:200])
    assert "default-src 'none'" in headers["content-security-policy"], headers
    update = first_event(address)
    # A proxy that keeps events back would be slow, or never give one.
    assert time.monotonic() - begun < 10, "the events come late"
    assert update["about"]["size"] == SIZE, update
    status, _, layer = get(address, "runs/0/layers/picture?k=1")
    assert (status, len(layer)) == (200, 24 + 4 * SIZE[0] * SIZE[1]), (status, len(layer))
    status, _, pixel = get(address, "runs/0/pixel?x=3&y=4")
    assert status == 200 and json.loads(pixel)["samples"] == SAMPLES, pixel
    status, headers, png = get(address, "runs/0/picture.png?exposure=1")
    assert status == 200 and png.startswith(b"\x89PNG"), status
    assert "attachment" in headers["content-disposition"], headers
    if browser:
        in_a_browser(address, browser)
    print(f"{name}: the page, its events, its pictures and its downloads come through" + (", in a browser too" if browser else ""))


def behind_nginx(nginx, upstream, folder, browser):
    port = free_port()
    for part in ["client", "proxy", "fastcgi", "uwsgi", "scgi"]:
        (folder / part).mkdir()
    paths = "".join(f"{part}_temp_path {folder}/{part};\n" for part in ["proxy", "fastcgi", "uwsgi", "scgi"])
    conf = folder / "nginx.conf"
    conf.write_text(
        f"pid {folder}/nginx.pid; error_log {folder}/error.log; daemon off; worker_processes 1;\n"
        f"events {{}}\nhttp {{ access_log off; client_body_temp_path {folder}/client;\n{paths}"
        f"server {{ listen 127.0.0.1:{port};\n"
        f"location /some/night/ {{ proxy_pass {upstream}; }} }} }}\n"
    )
    command = [nginx, "-e", folder / "error.log", "-p", folder, "-c", conf]
    with subprocess.Popen(command, stderr=subprocess.PIPE) as proxy:
        try:
            address = f"http://127.0.0.1:{port}/some/night/"
            until("nginx", lambda: answers(address) or (proxy.poll() is not None and sys.exit(proxy.stderr.read().decode())))
            look("nginx", address, browser)
        finally:
            proxy.terminate()


def behind_jupyter(upstream, folder, browser):
    port, inner = free_port(), urllib.parse.urlsplit(upstream).port
    # Its own token is not what is tried here.
    flags = [f"--port={port}", "--ip=127.0.0.1", "--no-browser", "--allow-root", "--IdentityProvider.token=", "--ServerApp.password="]
    log = (folder / "jupyter.log").open("w")
    command = [sys.executable, "-m", "jupyter_server", *flags, f"--ServerApp.root_dir={folder}"]
    with subprocess.Popen(command, stdout=log, stderr=log) as proxy:
        try:
            address = f"http://127.0.0.1:{port}/proxy/{inner}/"
            until("Jupyter", lambda: answers(address))
            look("jupyter-server-proxy", address, browser)
        finally:
            proxy.terminate()


def main():
    program, nginx, browser = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        scene = ROOT / "scenes/diffuse.toml"
        size = "x".join(map(str, SIZE))
        flags = ["--backend", "cpu", "--size", size, "--spp", str(SAMPLES), "--film", folder / "a.npz", "-o", folder / "a.png", "-q"]
        subprocess.run([program, "render", scene, *flags], check=True, capture_output=True)
        upstream = f"http://127.0.0.1:{free_port()}/"
        listen = urllib.parse.urlsplit(upstream).netloc
        with subprocess.Popen([program, "watch", folder / "a.npz", "--listen", listen, "-q"]) as watch:
            try:
                until("page", lambda: answers(upstream))
                look("no proxy", upstream, browser)
                if nginx:
                    (folder / "nginx").mkdir()
                    behind_nginx(nginx, upstream, folder / "nginx", browser)
                if importlib.util.find_spec("jupyter_server_proxy"):
                    behind_jupyter(upstream, folder, browser)
            finally:
                watch.terminate()


if __name__ == "__main__":
    main()
