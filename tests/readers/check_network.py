#!/usr/bin/env python3
"""What osteo tells the network, read by others: pyigtl (tools, camera, signal, events), pycbsdk (Cerebus packets), pylsl. Counts and values
against osteo's own files; a tool that pyigtl tracks drills.

usage: check_network.py BIN_DIR FIXTURES WORK_DIR [SECONDS]     exits 77 (skipped) when pyigtl or neo is missing; pycbsdk and pylsl are left
out with a word where they are. SECONDS: of the session (4).
"""

import json, os, pathlib, shutil, socket, struct, subprocess, sys, threading, time

try:
    import numpy as np
    import pyigtl
    from pyigtl.messages import MessageBase, TransformMessage, message_type_to_class_constructor
except ImportError as e:
    print(f"skipped: {e}; ./test installs the readers when PyPI can be reached")
    sys.exit(77)

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from free_port import free_port

bin_dir, fixtures, work = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
seconds = float(sys.argv[4]) if len(sys.argv) > 4 else 4
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)


def osteo(*args, **more):
    return subprocess.run(
        [bin_dir / "osteo", *map(str, args), "--quiet"], check=True, cwd=work, capture_output=True, text=True, **more
    ).stdout


# pyigtl knows neither of these; their contents are read here by the specification, headers and checksums by pyigtl.
def message(kind, unpack):
    class Message(MessageBase):
        def __init__(self, timestamp=None, device_name=None):
            super().__init__(timestamp=timestamp, device_name=device_name)
            self._message_type = kind
            self._valid_message = True

        def _unpack_content(self, content):
            self.value = unpack(content)

    message_type_to_class_constructor[kind] = Message


def ndarray(c):
    scalar, dims = c[0], c[1]
    assert (scalar, dims) == (4, 2), (scalar, dims)
    return np.frombuffer(c[6:], ">i2").reshape(struct.unpack(">2H", c[2:6]))


def sensor(c):
    n, _, unit = struct.unpack(">BBQ", c[:10])
    return unit, struct.unpack(f">{n}d", c[10:])


message("NDARRAY", ndarray)
message("SENSOR", sensor)
message(
    "TDATA",
    lambda c: [
        (c[i : i + 20].rstrip(b"\0").decode(), c[i + 20], struct.unpack(">12f", c[i + 22 : i + 70]))
        for i in range(0, len(c), 70)
    ],
)
message(
    "STATUS", lambda c: (*struct.unpack(">Hq", c[:10]), c[10:30].rstrip(b"\0").decode(), c[30:].rstrip(b"\0").decode())
)


class All(dict):
    """Every message, where pyigtl keeps the last of each device."""

    def __init__(self):
        self.list = []

    def __setitem__(self, device, m):
        self.list.append(m)


class Listener:
    """A client of pyigtl from when a server is there until it has said that the session has ended."""

    def __init__(self, port):
        self.all = All()
        self.client = pyigtl.OpenIGTLinkClient("127.0.0.1", port, start_now=False)
        self.client.incoming_messages = self.all
        self.client.start()

    def stop(self, most_s=600):
        until = time.time() + most_s
        while not any(m.device_name == "SessionEnd" for m in self.all.list[-20:]) and time.time() < until:
            time.sleep(0.02)
        self.client.stop()
        return self.all.list


def of(messages, device, kind=None):
    return [m for m in messages if m.device_name == device and (kind is None or m._message_type == kind)]


osteo("phantom", "ct.nrrd", "--labels-out", "l.nrrd", "--region", "temporal", "--spacing-mm", 1)
osteo(
    "prepare",
    "ct.nrrd",
    "-o",
    "case",
    "--spacing-mm",
    1,
    "--structures",
    "l.nrrd",
    "--names",
    "6=facial nerve, 13=chorda tympani",
    "--no-report",
)
path = [(0, 62, True), (seconds / 2, 48.5, True), (seconds, 46, True)]
strokes = {
    "osteotome_strokes": 1,
    "burr": {"kind": "cutting", "diameter_mm": 3},
    "axis": [0.96, 0.2, 0.2],
    "camera": {"centre_mm": [50, 9, -33], "radius_mm": 30, "eye": [1, 0, 0]},
    "waypoints": [{"t_s": t, "at_mm": [x, 9.5, -33.5], "drill": on} for t, x, on in path],
}
(work / "s.json").write_text(json.dumps(strokes))


def own_samples(folder, channels):
    return np.frombuffer((work / folder / "monitor.ns5").read_bytes()[314 + 66 * channels + 9 :], "<i2").reshape(
        -1, channels
    )


def check_signal(messages, own, end, name):
    blocks = of(messages, "NerveSignal")
    at = 0
    for m in blocks:
        assert round(m.timestamp * 30000) == at, (m.timestamp, at)  # its first sample
        at += len(m.value)
    signal = np.concatenate([m.value for m in blocks])
    assert len(signal) == end["samples"] and (signal == own[: len(signal)]).all(), name
    return len(signal)


# 1. Live, without a window, two listeners.
port = free_port()
listeners = [Listener(port), Listener(port)]
run = subprocess.Popen(
    [
        bin_dir / "osteo",
        "rehearse",
        "case",
        "--headless",
        "--script",
        "s.json",
        "-o",
        "session",
        "--stream",
        f"igtl:{port}",
    ],
    cwd=work,
    stdout=subprocess.PIPE,
    stderr=subprocess.PIPE,
    text=True,
)
live = [l.stop() for l in listeners]
out, err = run.communicate(timeout=600)
assert run.returncode in (0, 8), (run.returncode, err)
told = json.loads(osteo("nerve-monitor", "session", "-o", "out", "--json"))
channels = len(told["channels"])
own = own_samples("out", channels)
for messages in live:
    end = json.loads(of(messages, "SessionEnd")[0].string)
    # Who connects a moment late lacks the beginning, and nothing else.
    blocks = of(messages, "NerveSignal")
    first = round(blocks[0].timestamp * 30000)
    signal = np.concatenate([m.value for m in blocks])
    lost = [m for m in of(messages, "NerveEvent") if json.loads(m.string)["event"] == "lost"]
    if not lost:
        assert first + len(signal) == end["samples"], (first, len(signal), end)
        assert (signal == own[first : first + len(signal)]).all()
print(
    f"ok  live: {len(live)} listeners of pyigtl, {end['samples']} samples of {channels} channels, bit for bit those of 'osteo nerve-monitor'"
)

# 2. The finished session, from its first sample on.
port = free_port()
listener = Listener(port)
streamed = json.loads(osteo("stream", "session", "--to", f"igtl:{port}", "--json", "--speed", 2))
messages = listener.stop()
end = json.loads(of(messages, "SessionEnd")[0].string)
assert streamed["dropped"] == 0 and streamed["same_as_recorded"], streamed
assert end["samples"] == streamed["samples"] == told["samples"], (end, streamed, told["samples"])
n = check_signal(messages, own, end, "stream")
setup = json.loads(of(messages, "NerveSetup")[0].string)
assert setup["channels"] == told["channels"] and setup["uv_per_bit"] == 0.25, setup
events = [json.loads(m.string) for m in of(messages, "NerveEvent")]
expected = {k: v for k, v in told["events"].items() if k != "cause"}
assert {k: sum(e["event"] == k for e in events) for k in expected} == expected and len(events) == end["events"], (
    expected,
    events,
)
tools = of(messages, "Tool", "TRANSFORM")
assert (
    len(tools)
    == len(of(messages, "Tools", "TDATA"))
    == len(of(messages, "Force"))
    == len(of(messages, "Pedal"))
    == end["tools"]
)
# The same poses as in the session, RAS instead of LPS.
osteo("export", "session", "ticks.csv")
rows = [line.split(",") for line in (work / "ticks.csv").read_text().splitlines()]
columns = {name: i for i, name in enumerate(rows[0])}
x = next(columns[c] for c in columns if c in ("x_mm", "position_x_mm", "px_mm"))
shown = next((columns[c] for c in columns if c.startswith("shown") and "x" in c), None)
every = round(1000 / 60)
for i, m in enumerate(tools):
    row = rows[1 + i * every]
    at = np.array([float(v) for v in row[x : x + 3]])
    if shown is not None:
        at += [float(v) for v in row[shown : shown + 3]]
    assert np.abs(m.matrix[:3, 3] - at * [-1, -1, 1]).max() < 2e-3, (i, m.matrix, at)
    assert (
        np.abs(m.matrix[:3, :3].T @ m.matrix[:3, :3] - np.eye(3)).max() < 1e-5 and np.linalg.det(m.matrix[:3, :3]) > 0
    )
    assert np.abs(m.matrix[:3, 2] - np.array([-0.96, -0.2, 0.2]) / np.linalg.norm([0.96, 0.2, 0.2])).max() < 1e-5
force = max(np.linalg.norm(m.value[1]) for m in of(messages, "Force"))
assert 0.05 < force < 50 and of(messages, "Force")[0].value[0] == 0x02C4 << 48, force
assert of(messages, "Camera", "TRANSFORM"), "the script's camera"
statuses = [m.value[0] for m in of(messages, "Osteotome")]
assert statuses[0] == 1 and statuses[-1] == 19, statuses
# No date and no name leaves: times are the session's own, from 0.
assert max(m.timestamp for m in messages) < seconds + 60
for word in (b"case", b"session", str(work).encode(), os.uname().nodename.encode()):
    assert not any(word in getattr(m, "string", "").encode() for m in messages if m.device_name != "NerveEvent"), word
print(f"ok  pyigtl: {n} samples, {len(tools)} poses, {len(events)} events of the finished session")

# 3. A tool that pyigtl tracks moves the drill and presses its pedal.
port = free_port()
tracker = pyigtl.OpenIGTLinkServer(port=port, local_server=True)
matrix = np.eye(4)
axis = np.array([-0.96, -0.2, 0.2]) / np.linalg.norm([0.96, 0.2, 0.2])
matrix[:3, 2] = axis
matrix[:3, 0] = np.cross([0, 0, 1], axis) / np.linalg.norm(np.cross([0, 0, 1], axis))
matrix[:3, 1] = np.cross(axis, matrix[:3, 0])


class Pedal(MessageBase):
    def __init__(self, value):
        super().__init__(device_name="DrillPedal", timestamp=1)
        self._message_type = "SENSOR"
        self._valid_message = True
        self.value = value

    def _pack_content(self):
        return struct.pack(">BBQd", 1, 0, 0, self.value)


run = subprocess.Popen(
    [
        bin_dir / "osteo",
        "rehearse",
        "case",
        "--headless",
        "--seconds",
        str(seconds + 3),
        "--device",
        "igtl",
        "--tracker",
        f"127.0.0.1:{port}/Drill",
        "-o",
        "tracked",
    ],
    cwd=work,
    stdout=subprocess.PIPE,
    stderr=subprocess.PIPE,
    text=True,
)
begin, sent = None, 0
while run.poll() is None:
    if tracker.is_connected():
        begin = begin or time.time()
        t = time.time() - begin
        matrix[:3, 3] = [-np.interp(t, [0, seconds / 2, seconds], [62, 48.5, 46]), -9.5, -33.5]
        tracker.send_message(TransformMessage(matrix, timestamp=1, device_name="Drill"), wait=False)
        tracker.send_message(Pedal(1.0), wait=False)
        sent += 1
        if sent % 10 == 0:
            broken = matrix.copy()
            broken[0, 0] = np.nan
            tracker.send_message(TransformMessage(broken, timestamp=1, device_name="Drill"), wait=False)
    time.sleep(0.01)
err = run.stderr.read()
assert run.returncode in (0, 8), err
line = next(l for l in err.splitlines() if l.startswith("tracker: "))
heard, refused = int(line.split()[1]), int(line.split()[3])
assert heard > 0.5 * sent and refused > 0, (line, sent)
removed = float(next(l for l in err.splitlines() if "removed" in l).split("removed ")[1].split()[0])
assert removed > 5, err
assert subprocess.run([bin_dir / "osteo", "replay", "tracked", "--quiet"], cwd=work).returncode == 0
print(f"ok  tracked by pyigtl: {heard} poses of {sent}, {refused} refused, {removed} mm3 removed, replayed to the bit")
tracker.stop()

# 4. Cerebus packets.
try:
    import importlib.metadata

    cbsdk = importlib.metadata.version("pycbsdk").startswith(
        "0."
    )  # from 9 on it is a library that wants a processor that answers
except ImportError as e:
    print(f"left out: {e}")
    cbsdk = None
versions = ("3.11", "4.0", "4.1", "4.2") if len(sys.argv) > 4 else ("3.11", "4.1")
for version in versions if cbsdk else ():
    # UDP loses what a reader in Python on a busy machine does not fetch in time: slower, then. What comes is right at any speed.
    for speed in (0.5, 0.2, 0.05):
        port = free_port(socket.SOCK_DGRAM)
        reader = subprocess.Popen(
            [
                sys.executable,
                "-W",
                "ignore",
                pathlib.Path(__file__).with_name("read_cerebus.py"),
                version,
                str(port),
                work / "cerebus.npz",
            ],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        assert reader.stdout.readline().strip() == "listening"
        streamed = json.loads(
            osteo("stream", "session", "--to", f"cerebus:127.0.0.1:{port}/{version}", "--json", "--speed", speed)
        )
        assert reader.wait(timeout=600) == 0
        got = np.load(work / "cerebus.npz")
        times = got["times"]
        assert (np.diff(times) > 0).all() and (got["rows"] == own[times]).all(), version
        if len(times) == streamed["samples"]:
            break
    else:
        raise AssertionError(f"{version}: {streamed['samples'] - len(times)} samples never came")
    print(f"ok  pycbsdk {version}: {len(times)} samples of {channels} channels at {speed} times real time")

# 5. Lab Streaming Layer, with the library that pylsl brings.
try:
    import pylsl
    import pylsl.lib

    library = pathlib.Path(pylsl.lib.__file__).with_name("liblsl.so")
    if not library.exists():
        library = pathlib.Path(pylsl.lib.lib._name)
except Exception as e:
    print(f"left out: {e}")
    pylsl = None
if pylsl:
    # This machine alone.
    (work / "lsl.cfg").write_text("[multicast]\nResolveScope = machine\n")
    os.environ["LSLAPICFG"] = str(work / "lsl.cfg")
    reader = subprocess.Popen(
        [sys.executable, pathlib.Path(__file__).with_name("read_lsl.py"), work / "lsl.npy"],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert reader.stdout.readline().strip() == "looking"
    streamed = json.loads(
        osteo("stream", "session", "--to", "lsl", "--json", env={**os.environ, "OSTEO_LSL_LIBRARY": str(library)})
    )
    out, _ = reader.communicate(timeout=300)
    assert reader.returncode == 0, out
    got = np.load(work / "lsl.npy")
    assert got.shape == own.shape and (got == own).all(), (got.shape, own.shape)
    print(f"ok  pylsl: {len(got)} samples of {channels} channels, {out.strip()}")
