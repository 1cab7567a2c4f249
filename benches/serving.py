"""Measures nginx as the host of many relightable photographs: visitors a second, latency, and what saturates.

python3 serving.py [FOLDER] [--program ltm-export] [--names 100000] [--folders 256] [--rate 1000] [--seconds 20]
                   [--report FILE.json] [--check]

FOLDER has .ltm files; without it, three small ones are simulated. They are published under `--names` names in a
temporary folder and served by nginx on loopback, with the configuration that docs/hosting.md shows. Three runs follow,
in each of which `--rate` visitors a second arrive at random times and choose a random name:

  pictures     each fetches a photograph as the element does
  revalidate   each has the photograph in the cache and asks whether it is current (304)
  whole        the peer: each downloads the whole file with one plain GET

`--check` compares responses with 20 names, loads the server for two seconds, and measures nothing. The exit status is
1 if a response is wrong. Needs Linux, Python 3.11 and nginx (Debian: apt-get install --no-install-recommends
nginx-light).

The load generator is written here because each visitor needs a new connection, arrives at a planned time whatever the
server does, and sends ranges that depend on the file. wrk and autocannon have a fixed number of connections, each of
which waits for its response. h2load sends the same headers in all requests. tsung does not report when a byte inside a
response arrives, which is the time of the first picture.
"""

import argparse
import asyncio
import contextlib
import hashlib
import http.client
import itertools
import json
import os
import pwd
import random
import re
import resource
import shutil
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

REPO = Path(__file__).resolve().parent.parent

# Length of the element's first request: FIRST_BYTES in www/src/loading/load.ts.
FIRST_BYTES = 1 << 14
# Most file systems allow fewer than 65,000 hard links to a file.
NAMES_PER_COPY = 50_000
# A browser keeps its connection after the last response; nginx closes it after 75 s. Shorter here: each needs a file
# descriptor in this process.
KEEP_ALIVE_S = 10
TIMEOUT_S = 10
IMMUTABLE = "public, max-age=31536000, immutable, no-transform"
REPLACEABLE = "no-cache, no-transform"


@dataclass
class Photo:
    path: Path
    size: int
    hash: str
    # Ranges that the element requests, one after another: start and end.
    ranges: list[tuple[int, int]]
    # The first picture needs the file up to this byte.
    first_picture: int
    etag: str = ""


def read_photo(path: Path, program: str) -> Photo:
    """Plans the requests of the element. `open` in www/src/loading/load.ts requests the first 16 KiB, and then what
    `LtmReader::wants` in src/format/reader.rs returns: the rest of the index, then all chunks, which are adjacent. The
    element draws a first picture once the first scan is complete. Of a file of several levels, only the coarsest is
    simulated."""
    output = subprocess.run([program, "inspect", "--json", path], check=True, capture_output=True).stdout
    index = json.loads(output)
    end = index["levels"][-1]["bytes"] if index.get("levels") else index["file_bytes"]
    bounds = [0, FIRST_BYTES, max(FIRST_BYTES, index["index_bytes"]), max(FIRST_BYTES, end)]
    return Photo(
        path=path,
        size=index["file_bytes"],
        hash=hashlib.sha256(path.read_bytes()).hexdigest()[:12],
        ranges=[(start, end) for start, end in itertools.pairwise(bounds) if start < end],
        first_picture=index["scans"][0]["prefix_bytes"],
    )


def simulate_photos(folder: Path, program: str) -> None:
    for scene, seed in [("stained-glass", 1), ("cookies", 1), ("cookies", 2)]:
        capture, output = folder / f"{scene}-{seed}", folder / f"{scene}-{seed}.ltm"
        size = ["--camera", "128x128", "--light", "64x64"]
        simulate = [program, "simulate", scene, *size, "--seed", str(seed), "-o", capture]
        for command in simulate, [program, "recover", capture, "--method", "nnls", "-o", output]:
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def publish(photos: list[Photo], root: Path, names: int, folders: int) -> list[tuple[str, Photo]]:
    """Links the files under many names, and returns the paths of their URLs. The number chooses the folder, not the
    hash, which is the same for all names of a file."""
    for folder in range(folders):
        (root / f"{folder:02x}").mkdir(parents=True)
    copies: dict[str, Path] = {}
    published = []
    for number in range(names):
        photo = photos[number % len(photos)]
        if number // len(photos) % NAMES_PER_COPY == 0:
            copies[photo.hash] = root.parent / f"{number}.ltm"
            # copy2 keeps the modification time, from which nginx computes the ETag.
            shutil.copy2(photo.path, copies[photo.hash])
        path = f"{number % folders:02x}/photo-{number}.{photo.hash}.ltm"
        os.link(copies[photo.hash], root / path)
        published.append((f"/{path}", photo))
    return published


def configuration(port: int) -> str:
    """The nginx blocks of docs/hosting.md, inside the least that nginx needs."""
    text = (REPO / "docs/hosting.md").read_text()
    documented = "\n".join(re.findall(r"^```nginx\n(.*?)^```", text, re.MULTILINE | re.DOTALL))
    user = f"user {pwd.getpwuid(0).pw_name};" if os.geteuid() == 0 else ""
    modules = ["client_body", "proxy", "fastcgi", "uwsgi", "scgi"]
    temporary = "\n".join(f"{module}_temp_path temporary;" for module in modules)
    return f"""
        {user}
        worker_processes auto;
        pid nginx.pid;
        error_log error.log;
        events {{ worker_connections 20000; }}
        http {{
            include /etc/nginx/mime.types;
            {temporary}
            access_log access.log;
            sendfile on;
            tcp_nopush on;
            server {{
                listen 127.0.0.1:{port} backlog=4096;
                root public;
                {documented}
            }}
        }}"""


@contextlib.contextmanager
def nginx(folder: Path):
    """Runs nginx, which serves `folder`/public. Yields its port and process id."""
    command = shutil.which("nginx", path=f"{os.environ['PATH']}:/usr/sbin")
    if command is None:
        sys.exit("serving: nginx is missing (Debian: apt-get install --no-install-recommends nginx-light)")
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    (folder / "nginx.conf").write_text(configuration(port))
    arguments = ["-p", folder, "-c", "nginx.conf", "-e", "error.log", "-g", "daemon off;"]
    # The kernel ends nginx if this process is killed.
    server = subprocess.Popen(["setpriv", "--pdeathsig", "TERM", command, *arguments])
    try:
        for _ in range(100):
            if server.poll() is not None:
                sys.exit("serving: nginx did not start")
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port)):
                break
            time.sleep(0.05)
        yield port, server.pid
    finally:
        server.terminate()
        server.wait()
    # The check requests a missing file.
    log = (folder / "error.log").read_text().splitlines()
    problems = [line for line in log if "[notice]" not in line and "missing.ltm" not in line]
    if problems:
        sys.exit(f"serving: nginx reports {len(problems)} errors: {problems[0]}")


# Correctness


class Checks:
    def __init__(self, port: int):
        self.connection = http.client.HTTPConnection("127.0.0.1", port, timeout=TIMEOUT_S)
        self.failures: list[str] = []
        self.count = 0

    def request(self, path: str, status: int, body: bytes | None, headers: dict[str, str], *, method="GET", **expected):
        """Compares a response, its `body` unless that is None, and headers given as `content_length="3"`, where None
        means an absent header. Returns the headers."""
        self.connection.request(method, path, headers={"Accept-Encoding": "gzip, br", **headers})
        response = self.connection.getresponse()
        received = response.read()
        got = {name: response.headers.get(name.replace("_", "-")) for name in expected}
        self.count += 1
        request = f"{method} {path} {headers}"
        if response.status != status:
            self.failures.append(f"{request}: status {response.status}, expected {status}")
        if body is not None and received != body:
            self.failures.append(f"{request}: another body, of {len(received)} bytes, expected {len(body)}")
        wrong = [name for name, value in expected.items() if got[name] != value]
        self.failures.extend(f"{request}: {name}: {got[name]}, expected {expected[name]}" for name in wrong)
        return response.headers

    def photo(self, path: str, photo: Photo, cache_control: str) -> None:
        content = photo.path.read_bytes()
        size = len(content)
        common = {"content_type": "application/vnd.ltm", "cache_control": cache_control, "content_encoding": None}
        whole = self.request(path, 200, content, {}, accept_ranges="bytes", **common)
        etag = photo.etag = whole["ETag"] or ""
        if not etag.startswith('"'):
            self.failures.append(f"{path}: the ETag {etag} is not strong")
        common["etag"] = etag
        if cache_control == IMMUTABLE:
            common["access_control_allow_origin"] = "*"
            common["access_control_expose_headers"] = "Content-Range, ETag"

        self.request(path, 200, b"", {}, method="HEAD", accept_ranges="bytes", content_length=str(size), **common)
        for start, end in photo.ranges:
            part = content[start:end]
            content_range = f"bytes {start}-{start + len(part) - 1}/{size}"
            request = {"Range": f"bytes={start}-{end - 1}"}
            self.request(path, 206, part, request, content_range=content_range, **common)
            self.request(path, 206, part, {**request, "If-Range": etag}, content_range=content_range, **common)
            self.request(path, 200, content, {**request, "If-Range": '"other"'}, content_range=None, **common)
            self.request(path, 304, b"", {**request, "If-None-Match": etag}, cache_control=cache_control, etag=etag)
            self.request(path, 206, part, {**request, "If-None-Match": '"other"'}, **common)
        self.request(path, 304, b"", {"If-None-Match": etag}, cache_control=cache_control, etag=etag)
        beyond = {"Range": f"bytes={size}-{size + FIRST_BYTES}"}
        self.request(path, 416, None, beyond, content_range=f"bytes */{size}")


def check(port: int, published: list[tuple[str, Photo]], root: Path, photos: list[Photo]) -> list[str]:
    """Compares all kinds of responses, prints the first differences, and sets the ETags of the photos."""
    checks = Checks(port)
    for photo in photos:
        replaceable = photo.path.name
        shutil.copy2(photo.path, root / replaceable)
        checks.photo(f"/{replaceable}", photo, REPLACEABLE)
        path = next(path for path, other in published if other is photo)
        checks.photo(path, photo, IMMUTABLE)
    checks.request("/missing.ltm", 404, None, {}, cache_control=None)
    print(f"{checks.count} responses compared, {len(checks.failures)} differences")
    for failure in checks.failures[:10]:
        print(f"  {failure}", file=sys.stderr)
    return checks.failures


# Load


@dataclass
class Run:
    """What the visitors of a run saw. Times are in seconds."""

    started: list[float] = field(default_factory=list)
    first_pictures: list[float] = field(default_factory=list)
    whole: list[float] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)
    requests: int = 0
    bytes: int = 0
    seconds: float = 0
    cores: dict[str, float] = field(default_factory=dict)


# Bodies are counted only, so all visitors read into the same buffer.
DISCARDED = bytearray(1 << 18)


async def request(connection: socket.socket, path: str, headers: str, status: int, expected: int, mark: int):
    """Sends a request, and reads a response of `expected` bytes. Returns when `mark` bytes of it had arrived."""
    loop = asyncio.get_running_loop()
    message = f"GET {path} HTTP/1.1\r\nHost: localhost\r\nAccept-Encoding: identity\r\n{headers}\r\n"
    await loop.sock_sendall(connection, message.encode())
    data = b""
    while b"\r\n\r\n" not in data:
        received = await loop.sock_recv(connection, 1 << 14)
        if not received:
            raise ConnectionError("the connection was closed before the response")
        data += received
    head, body = data.split(b"\r\n\r\n", 1)
    if int(head[9:12]) != status:
        raise ValueError(f"status {head[9:12].decode()}, expected {status}")
    length = re.search(rb"\r\nContent-Length: (\d+)", head)
    if int(length[1] if length else 0) != expected:
        raise ValueError(f"length {length and length[1]}, expected {expected}")
    count, marked = len(body), None
    while True:
        if marked is None and count >= mark:
            marked = time.perf_counter()
        if count >= expected:
            return marked
        received = await loop.sock_recv_into(connection, DISCARDED)
        if not received:
            raise ConnectionError("the connection was closed inside the response")
        count += received


def requests_of(photo: Photo, kind: str):
    """Yields the requests of a visitor: headers, expected status and length of the body, and how much of the body
    completes the first picture. Chromium sends the same ranges and conditions: its cache adds If-Range to each range
    after the first, and If-None-Match to each that it has."""
    if kind == "whole":
        yield "", 200, photo.size, photo.size
        return
    for start, end in photo.ranges:
        byte_range = f"Range: bytes={start}-{end - 1}\r\n"
        if kind == "revalidate":
            yield f"{byte_range}If-None-Match: {photo.etag}\r\n", 304, 0, 0
        else:
            length = min(end, photo.size) - start
            if_range = f"If-Range: {photo.etag}\r\n" if start else ""
            yield byte_range + if_range, 206, length, min(max(photo.first_picture - start, 0), length)


async def visit(port: int, path: str, photo: Photo, kind: str, arrival: float, run: Run, keep_alive: float) -> None:
    loop = asyncio.get_running_loop()
    connection = socket.socket()
    connection.setblocking(False)
    run.started.append(time.perf_counter() - arrival)
    try:
        # Ethernet's segment size. With loopback's segments of 64 kB, delayed acknowledgements add 40 ms.
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_MAXSEG, 1460)
        # One address has too few ports for all visitors.
        connection.bind((f"127.0.0.{random.randrange(2, 250)}", 0))
        async with asyncio.timeout(TIMEOUT_S):
            await loop.sock_connect(connection, ("127.0.0.1", port))
            position, first_picture = 0, None
            for headers, status, length, mark in requests_of(photo, kind):
                marked = await request(connection, path, headers, status, length, mark)
                run.requests += 1
                run.bytes += length
                position += length
                if first_picture is None and (position >= photo.first_picture or not length):
                    first_picture = marked
            run.first_pictures.append(first_picture - arrival)
            run.whole.append(time.perf_counter() - arrival)
    except (OSError, ValueError) as error:
        run.errors.append(f"{kind} {path}: {error or type(error).__name__}")
        connection.close()
        return
    loop.call_later(keep_alive, connection.close)


async def drive(port: int, published, kind: str, rate: float, seconds: float) -> Run:
    """Runs an open loop: visitors arrive at random times, however long those before them take. Times run from the
    planned arrival: a late generator makes them longer."""
    run = Run()
    files = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    keep_alive = min(KEEP_ALIVE_S, files / 2 / rate)
    begin = arrival = time.perf_counter()
    async with asyncio.TaskGroup() as visits:
        while arrival < begin + seconds:
            await asyncio.sleep(max(arrival - time.perf_counter(), 0))
            path, photo = random.choice(published)
            visits.create_task(visit(port, path, photo, kind, arrival, run, keep_alive))
            arrival += random.expovariate(rate)
    run.seconds = time.perf_counter() - begin
    return run


def cpu_seconds(pid: int) -> float:
    """CPU time of nginx's processes."""
    workers = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    ticks = 0
    for process in [pid, *workers]:
        fields = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
        ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def busy_seconds() -> float:
    """CPU time of the whole machine, without idle and waiting."""
    times = [int(ticks) for ticks in Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:9]]
    return (sum(times) - times[3] - times[4]) / os.sysconf("SC_CLK_TCK")


def measure(port: int, pid: int, published, kind: str, rate: float, seconds: float) -> Run:
    before = cpu_seconds(pid), time.process_time(), busy_seconds()
    # Sockets that are still open are freed with the loop.
    run = asyncio.run(drive(port, published, kind, rate, seconds))
    after = cpu_seconds(pid), time.process_time(), busy_seconds()
    server, generator, busy = ((b - a) / run.seconds for a, b in zip(before, after, strict=True))
    run.cores = {"nginx": server, "generator": generator, "other": max(busy - server - generator, 0)}
    return run


def percentiles(times: list[float]) -> dict[str, float]:
    """Milliseconds."""
    if len(times) < 2:
        return dict.fromkeys(["median", "p95", "p99"], float("nan"))
    cuts = statistics.quantiles(times, n=100)
    return {"median": cuts[49] * 1e3, "p95": cuts[94] * 1e3, "p99": cuts[98] * 1e3}


def figures(run: Run) -> dict:
    return {
        "visitors_per_s": len(run.whole) / run.seconds,
        "requests_per_s": run.requests / run.seconds,
        "megabytes_per_s": run.bytes / run.seconds / 1e6,
        "first_picture_ms": percentiles(run.first_pictures),
        "whole_ms": percentiles(run.whole),
        "generator_delay_ms": percentiles(run.started),
        "cores": run.cores,
        "errors": len(run.errors),
    }


def print_figures(name: str, result: dict) -> None:
    print(
        f"\n{name}: {result['visitors_per_s']:.0f} visitors/s, {result['requests_per_s']:.0f} requests/s, "
        f"{result['megabytes_per_s']:.0f} MB/s, {result['errors']} errors"
    )
    for row in ["first_picture_ms", "whole_ms", "generator_delay_ms"]:
        times = ", ".join(f"{key} {value:.1f}" for key, value in result[row].items())
        print(f"  {row:20} {times}")
    cores = ", ".join(f"{key} {value:.2f}" for key, value in result["cores"].items())
    print(f"  {f'cores of {os.cpu_count()}':20} {cores}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("folder", nargs="?", type=Path)
    parser.add_argument("--program", default=str(REPO / "target/release/ltm-export"))
    parser.add_argument("--names", type=int, default=100_000)
    parser.add_argument("--folders", type=int, default=256)
    parser.add_argument("--rate", type=float, default=1000)
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--report", type=Path)
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    if options.check:
        options.names, options.rate, options.seconds = 20, 50, 2
    # Ends nginx and removes the temporary folder on SIGTERM too.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("serving: terminated"))
    resource.setrlimit(resource.RLIMIT_NOFILE, (resource.getrlimit(resource.RLIMIT_NOFILE)[1],) * 2)

    with tempfile.TemporaryDirectory(prefix="serving-") as temporary:
        folder = Path(temporary)
        source = options.folder
        if source is None:
            source = folder / "simulated"
            source.mkdir()
            simulate_photos(source, options.program)
        photos = [read_photo(path, options.program) for path in sorted(source.glob("*.ltm"))]
        if not photos:
            sys.exit(f"serving: {source} has no .ltm files")
        for photo in photos:
            ranges = ", ".join(f"{start}-{end - 1}" for start, end in photo.ranges)
            print(f"{photo.path.name}: {photo.size} bytes, requests {ranges}, first picture at {photo.first_picture}")
        root = folder / "public"
        published = publish(photos, root, options.names, options.folders)
        print(f"{len(published)} names in {options.folders} folders; load average {os.getloadavg()[0]:.2f}")
        with nginx(folder) as (port, pid):
            failures = check(port, published, root, photos)
            results = {}
            for kind in "pictures", "revalidate", "whole":
                run = measure(port, pid, published, kind, options.rate, options.seconds)
                results[kind] = figures(run)
                failures += run.errors
                for error in run.errors[:3]:
                    print(f"  {error}", file=sys.stderr)
                if not options.check:
                    print_figures(kind, results[kind])

    pictures, whole = results["pictures"], results["whole"]
    ratios = {
        "first_picture_vs_whole_get": pictures["first_picture_ms"]["median"] / whole["whole_ms"]["median"],
        "ranges_vs_whole_get": pictures["whole_ms"]["median"] / whole["whole_ms"]["median"],
        "nginx_cpu_vs_whole_get": pictures["cores"]["nginx"] / max(whole["cores"]["nginx"], 1e-9),
    }
    if not options.check:
        print("\n" + "\n".join(f"{name}: {ratio:.2f}" for name, ratio in ratios.items()))
        if options.report:
            options.report.write_text(json.dumps({"figures": {**results, **ratios}}, indent=2) + "\n")
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
