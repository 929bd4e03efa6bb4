"""The audit trail of a patient's path: received, prepared, corrected, opened, approved, written, sent and de-identified, at a syslog server with TLS.
usage: check_audit.py BIN WORK"""

import gzip, json, os, pathlib, shutil, signal, socket, ssl, subprocess, sys, threading, time, xml.etree.ElementTree as xml

if not shutil.which("openssl"):
    print("skipped: openssl not installed")
    sys.exit(77)
try:
    import pydicom
except ImportError as e:
    print(f"skipped: {e}")
    sys.exit(77)
bin_dir, work = (pathlib.Path(a).resolve() for a in sys.argv[1:3])
osteo = bin_dir / "osteo"
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
os.chdir(work)
NAME, PID = "Mustermann^Annegret", "PID-4711"


def run(*args, rc=0, **env):
    r = subprocess.run([str(a) for a in args], capture_output=True, text=True, env=os.environ | env)
    assert r.returncode == rc, (args, r.returncode, r.stdout[-2000:], r.stderr[-2000:])
    return r


class Syslog:
    """RFC 5425: frames of counted octets over TLS, to who has a certificate."""

    def __init__(self, port=0):
        self.text, self.stopped = b"", False
        self.listener = socket.create_server(("127.0.0.1", port))
        self.port = self.listener.getsockname()[1]
        self.context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        self.context.load_cert_chain("cert.pem", "key.pem")
        self.context.load_verify_locations("cert.pem")
        self.context.verify_mode = ssl.CERT_REQUIRED
        self.thread = threading.Thread(target=self.serve, daemon=True)
        self.thread.start()

    def serve(self):
        while not self.stopped:
            try:
                with self.context.wrap_socket(self.listener.accept()[0], server_side=True) as c:
                    while some := c.recv(65536):
                        self.text += some
            except OSError:
                pass

    def stop(self):
        self.stopped = True
        self.listener.shutdown(socket.SHUT_RDWR)
        self.listener.close()
        self.thread.join(30)

    def messages(self):
        out, rest = [], self.text
        while rest:
            n, rest = rest.split(b" ", 1)
            frame, rest = rest[: int(n)], rest[int(n) :]
            assert len(frame) == int(n), "a frame is cut"
            head, body = frame.split(b"\xef\xbb\xbf", 1)
            words = head.split()
            assert (
                words[0] == b"<85>1" and words[3] == b"osteo" and words[5] == b"DICOM+RFC3881" and words[6] == b"-"
            ), head
            out.append(xml.fromstring(body))
        return out


def kinds(server):
    return [m.find("EventIdentification/EventTypeCode").get("csd-code") for m in server.messages()]


def until(what, seconds=60):
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.1)


run(
    "openssl",
    "req",
    "-x509",
    "-newkey",
    "ec",
    "-pkeyopt",
    "ec_paramgen_curve:P-256",
    "-nodes",
    "-days",
    "2",
    "-subj",
    "/CN=log",
    "-addext",
    "subjectAltName=IP:127.0.0.1",
    "-keyout",
    "key.pem",
    "-out",
    "cert.pem",
)
run(osteo, "phantom", "ct", "--region", "temporal", "--spacing-mm", "2", "--quiet")
files = sorted(p for p in pathlib.Path("ct").rglob("*") if p.is_file())
for f in files:
    d = pydicom.dcmread(f)
    d.PatientName, d.PatientID = NAME, PID
    d.save_as(f)
study = str(d.StudyInstanceUID)

server = Syslog()
settings = {
    "osteotome_audit": 1,
    "to": f"tls://127.0.0.1:{server.port}",
    "ca": str(work / "cert.pem"),
    "certificate": str(work / "cert.pem"),
    "key": str(work / "key.pem"),
    "queue": str(work / "queue"),
    "source": "ward",
}
pathlib.Path("audit.json").write_text(json.dumps(settings))
off = {"OSTEO_AUDIT": ""}
on = {"OSTEO_AUDIT": str(work / "audit.json")}
doctor = lambda rc, **env: next(
    c
    for c in json.loads(
        run(
            osteo, "doctor", "--server", "--json", "--no-report", "--port", "1", "--bind", "127.0.0.1", rc=rc, **env
        ).stdout
    )["checks"]
    if c["what"] == "audit"
)

node = subprocess.Popen(
    [osteo, "receive", "inbox", "--allow", "SCANNER", "--port", "0", "--json", "--keep-free-gb", "0", "--quiet-s", "1"],
    stdout=subprocess.PIPE,
    stderr=open("node.log", "w"),
    text=True,
    env=os.environ | on,
)
port = json.loads(node.stdout.readline())["listening"]
peer = ["--peer", f"OSTEOTOME@127.0.0.1:{port}", "--ae", "SCANNER", "--no-check", "--quiet"]
run(osteo, "send", "ct", *peer, **off)
closed = json.loads(node.stdout.readline())
assert closed["objects"] == len(files), closed
until(lambda: kinds(server) == ["receive"])

# A server that is away: work goes on and says so, nothing is lost, and it comes in its order.
server.stop()
case = ["case", "--quiet"]
run(osteo, "prepare", "ct", "-o", "case", "--quiet", **on)
r = run(osteo, "approve", "case", "--by", "A. Miller", **on)
assert "audit messages wait" in r.stderr, r.stderr
run(osteo, "report", *case, "--dicom", "case.dcm", **on)
run(osteo, "export-slicer", "case", "given", "--quiet", **on)
# Half of the bone is taken away, as another program would.
head, voxels = pathlib.Path("given/bone.seg.nrrd").read_bytes().split(b"\n\n", 1)
packed = b"encoding: gz" in head
voxels = bytearray(gzip.decompress(voxels) if packed else voxels)
voxels[: len(voxels) // 2] = bytes(len(voxels) // 2)
pathlib.Path("given/bone.seg.nrrd").write_bytes(head + b"\n\n" + (gzip.compress(voxels) if packed else bytes(voxels)))
run(osteo, "import-slicer", "case", "given", "--quiet", **on)
late = Syslog(server.port)
run(osteo, "send", "ct", *peer, **on)
run(osteo, "deidentify", "ct", "-o", "copies", "--quiet", **on)
run(osteo, "approve", *case, "--withdraw", **on)
node.send_signal(signal.SIGTERM)
assert node.wait(60) in (0, 130)
late.stop()
got = kinds(late)
assert [k for k in got if k != "receive"] == [
    "approve",
    "hand-over",
    "hand-over",
    "edit",
    "send",
    "deidentify",
    "withdraw",
], got

# What each says.
all_of = server.messages() + late.messages()
by = {m.find("EventIdentification/EventTypeCode").get("csd-code"): m for m in all_of}
assert by["receive"].find("ActiveParticipant").get("UserID") == "SCANNER"
assert by["receive"].find("EventIdentification/EventID").get("csd-code") == "110104"
for kind in ("receive", "send", "deidentify"):
    objects = {o.get("ParticipantObjectTypeCode"): o for o in by[kind].findall("ParticipantObjectIdentification")}
    assert (
        objects["2"].get("ParticipantObjectID") == study and objects["1"].get("ParticipantObjectID") == PID
    ), xml.tostring(by[kind])
    assert sum(int(s.get("NumberOfInstances")) for s in objects["2"].iter("SOPClass")) == len(files)
codes = {
    by[k].find("ParticipantObjectIdentification").get("ParticipantObjectID")
    for k in ("approve", "hand-over", "edit", "withdraw")
}
assert len(codes) == 1 and "case" not in codes, codes
assert all(m.find("AuditSourceIdentification").get("AuditSourceID") == "ward" for m in all_of)
everything = server.text + late.text
for word in (NAME, *NAME.split("^"), "Miller"):
    assert word.encode() not in everything, word

# Failure is told as such; a wrong setting stops work before it begins; doctor tells of each.
alone = json.loads(json.dumps(settings)) | {"to": f"file:{work}/audit.log"}
for key in ("ca", "certificate", "key"):
    del alone[key]
pathlib.Path("file.json").write_text(json.dumps(alone))
to_file = {"OSTEO_AUDIT": str(work / "file.json")}
run(osteo, "send", "ct", "--peer", f"NOBODY@127.0.0.1:{port}", "--timeout-s", "2", "--quiet", rc=7, **to_file)
assert 'EventOutcomeIndicator="4"' in pathlib.Path("audit.log").read_text().splitlines()[-1]
run(osteo, "rehearse", "case", "--headless", "--seconds", "1", "-o", "session", "--quiet", **to_file)
assert 'csd-code="open"' in pathlib.Path("audit.log").read_text().splitlines()[-1]
pathlib.Path("bad.json").write_text('{"osteotome_audit": 1, "to": "udp://127.0.0.1:514", "queue": "/tmp"}')
run(osteo, "approve", *case, "--by", "X", rc=2, OSTEO_AUDIT=str(work / "bad.json"))
assert "approved by" not in run(osteo, "info", "case").stdout
assert doctor(7, OSTEO_AUDIT=str(work / "bad.json"))["state"] == "bad"
dead = doctor(7, **on)
assert dead["state"] == "bad" and "0 messages wait" in dead["says"], dead
pathlib.Path("roles.json").write_text(
    '{"osteotome_roles": 1, "approve": ["nobody-of-here"], "send": ["nobody-of-here"]}'
)
nobody = to_file | {"OSTEO_ROLES": str(work / "roles.json")}
assert "may not approve" in run(osteo, "approve", *case, "--by", "X", rc=7, **nobody).stderr
assert "approved by" not in run(osteo, "info", "case").stdout
assert "may not send" in run(osteo, "send", "ct", *peer, rc=7, **nobody).stderr
run(osteo, "send", "ct", *peer, "--dry-run", **nobody)
assert [l.count('"110132"') for l in pathlib.Path("audit.log").read_text().splitlines()[-2:]] == [1, 1]
print("audit: all as it should be")
