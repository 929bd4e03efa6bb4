#!/usr/bin/env python3
"""osteo and the real hidapi against devices that umockdev plays: sysfs, udev, /dev/hidraw and its reports.

usage: check_devices.py BIN_DIR WORK_DIR      exits 77 (skipped) where umockdev is missing
"""

import json, os, pathlib, shutil, signal, struct, subprocess, sys, threading

bin_dir, work = (pathlib.Path(a).resolve() for a in sys.argv[1:3])
if not shutil.which("umockdev-run"):
    print("skipped: umockdev is missing")
    sys.exit(77)
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)

# A vendor's page with one input of 64 bytes: enough for hidapi to tell page and usage.
DESCRIPTOR = bytes(
    [
        0x06,
        0x00,
        0xFF,
        0x09,
        0x01,
        0xA1,
        0x01,
        0x15,
        0x00,
        0x26,
        0xFF,
        0x00,
        0x75,
        0x08,
        0x95,
        0x40,
        0x09,
        0x01,
        0x81,
        0x02,
        0xC0,
    ]
)


def device(name, vendor, product, label):
    usb = "/devices/pci0000:00/0000:00:14.0/usb1/1-1"
    interface = f"{usb}/1-1:1.0"
    ident = f"0003:{vendor:04X}:{product:04X}.0001"
    hid = f"{interface}/{ident}"
    uevent = f"DRIVER=hid-generic\\nHID_ID=0003:{vendor:08X}:{product:08X}\\nHID_NAME={label}\\nHID_PHYS=usb-0000:00:14.0-1/input0\\nHID_UNIQ=17\\n"
    text = f"""P: {hid}/hidraw/hidraw0
N: hidraw0
E: DEVNAME=/dev/hidraw0
E: SUBSYSTEM=hidraw
E: MAJOR=240
E: MINOR=0
A: dev=240:0\\n
L: device=../../../{ident}

P: {hid}
E: SUBSYSTEM=hid
E: DRIVER=hid-generic
E: HID_ID=0003:{vendor:08X}:{product:08X}
E: HID_NAME={label}
E: HID_PHYS=usb-0000:00:14.0-1/input0
E: HID_UNIQ=17
A: uevent={uevent}
H: report_descriptor={DESCRIPTOR.hex().upper()}

P: {interface}
E: SUBSYSTEM=usb
E: DEVTYPE=usb_interface
A: bInterfaceNumber=00\\n

P: {usb}
E: SUBSYSTEM=usb
E: DEVTYPE=usb_device
A: idVendor={vendor:04x}\\n
A: idProduct={product:04x}\\n
A: manufacturer=Maker\\n
A: product={label}\\n
A: serial=17\\n
A: bcdDevice=0100\\n

"""
    (work / f"{name}.umockdev").write_text(text)
    size, body = struct.pack("<i", len(DESCRIPTOR)), struct.pack("<I", len(DESCRIPTOR)) + DESCRIPTOR.ljust(4096, b"\0")
    (work / f"{name}.ioctl").write_text(
        f"@DEV /dev/hidraw0\nHIDIOCGRDESCSIZE 0 {size.hex().upper()}\nHIDIOCGRDESC 0 {body.hex().upper()}\n"
    )


def script(name, reports):
    """Reports, 0.3 s apart, as bytes in umockdev's escapes. The first comes late enough for the device to be open on a busy machine too: what
    was not read by then would be handed over together, which no real device does."""
    escaped = lambda r: "".join("^`" if b == 0x5E else "^" + chr(b + 64) if b < 32 else chr(b) for b in r)
    with open(work / f"{name}.script", "wb") as out:
        for i, r in enumerate(reports):
            out.write((b"r 3000 " if i == 0 else b"r 300 ") + escaped(r).encode("latin-1") + b"\n")


def command(name, *args):
    mock = ["umockdev-run", "-d", work / f"{name}.umockdev", "-i", f"/dev/hidraw0={work}/{name}.ioctl"]
    if (work / f"{name}.script").exists():
        mock += ["-s", f"/dev/hidraw0={work}/{name}.script"]
    return [*map(str, mock), "--", str(bin_dir / "osteo"), *args]


def run(name, *args):
    done = subprocess.run(command(name, *args), capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, f"{name}: exit {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stdout


def watch(name, *expected):
    """Watches until every expected text was printed, in lines as they come; returns all that was. Fails after two minutes without."""
    process = subprocess.Popen(
        command(name, "devices", "--watch", "600"),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    stop = threading.Timer(120, lambda: os.killpg(process.pid, signal.SIGKILL))
    stop.start()
    out = ""
    for line in process.stdout:
        out += line
        if all(e in out for e in expected):
            break
    stop.cancel()
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        pass
    process.wait()
    missing = [e for e in expected if e not in out]
    assert not missing, f"{name}: never said {missing}\n{out}"
    return out


device("mouse", 0x046D, 0xC626, "SpaceNavigator")
listed = json.loads(run("mouse", "devices", "--json"))
assert len(listed) == 1 and listed[0]["device"] == "3Dconnexion SpaceMouse" and listed[0]["readable"], listed
assert (
    listed[0]["vendor"] == "046d" and listed[0]["product"] == "c626" and listed[0]["name"] == "SpaceNavigator"
), listed
print("ok  SpaceMouse: found, opened")

move = struct.pack("<Bhhh", 1, 350, -175, 0)
script("mouse", [move, struct.pack("<Bhhh", 2, 0, 0, 350), bytes([3, 2, 0]), bytes([1, 2]), bytes([0x77] * 9), move])
watch("mouse", "move +1.00 +0.50", "turn +0.00 -0.00 -1.00", "buttons 2", "not understood")
print("ok  SpaceMouse: move, turn, button; short and garbled reports refused")

device("pedal", 0x05F3, 0x00FF, "Footpedal")
script("pedal", [bytes([1, 0]), bytes([5, 0]), bytes([0, 0])])
watch("pedal", "pedals 1", "pedals 5", "pedals 0")
print("ok  foot pedal")

device("arm", 0x16C0, 0x0486, "Polhem")
script(
    "arm",
    [
        struct.pack("<7h", 100, -200, 300, 10044, 5, 6, 0).ljust(64, b"\1"),
        struct.pack("<7h", 101, -201, 301, 44, 5, 6, 0).ljust(64, b"\1"),
    ],
)
watch("arm", "encoders 100 -200 300 44 5 6  button", "encoders 101 -201 301 44 5 6\n")
print("ok  WoodenHaptics: encoders, button")

device("other", 0x1234, 0x9999, "Something else")
assert json.loads(run("other", "devices", "--json")) == []
print("ok  a device that is not known is left alone")
doctor = json.loads(run("mouse", "doctor", "--seconds", "0.2", "--json"))
assert any("SpaceMouse" in d for d in doctor["devices"]) and doctor["loop"]["ticks"] > 50, doctor
print("ok  doctor lists it")
