"""Drops files onto a window as a desktop does: the source's half of XDND 5 (freedesktop.org), by Xlib alone.
usage: drop(WINDOW_ID, [PATHS]) with DISPLAY set; returns whether the window took it."""

import ctypes, time, urllib.parse

X = ctypes.CDLL("libX11.so.6")
X.XOpenDisplay.restype = ctypes.c_void_p
DISPLAY, ATOM, WINDOW = ctypes.c_void_p, ctypes.c_ulong, ctypes.c_ulong
CLIENT_MESSAGE, SELECTION_REQUEST, SELECTION_NOTIFY = 33, 30, 31


class ClientMessage(ctypes.Structure):
    _fields_ = [
        ("type", ctypes.c_int),
        ("serial", ctypes.c_ulong),
        ("send_event", ctypes.c_int),
        ("display", DISPLAY),
        ("window", WINDOW),
        ("message_type", ATOM),
        ("format", ctypes.c_int),
        ("data", ctypes.c_long * 5),
    ]


class SelectionRequest(ctypes.Structure):
    _fields_ = [
        ("type", ctypes.c_int),
        ("serial", ctypes.c_ulong),
        ("send_event", ctypes.c_int),
        ("display", DISPLAY),
        ("owner", WINDOW),
        ("requestor", WINDOW),
        ("selection", ATOM),
        ("target", ATOM),
        ("property", ATOM),
        ("time", ctypes.c_ulong),
    ]


class SelectionNotify(ctypes.Structure):
    _fields_ = [
        ("type", ctypes.c_int),
        ("serial", ctypes.c_ulong),
        ("send_event", ctypes.c_int),
        ("display", DISPLAY),
        ("requestor", WINDOW),
        ("selection", ATOM),
        ("target", ATOM),
        ("property", ATOM),
        ("time", ctypes.c_ulong),
    ]


class Event(ctypes.Union):
    _fields_ = [
        ("type", ctypes.c_int),
        ("client", ClientMessage),
        ("request", SelectionRequest),
        ("notify", SelectionNotify),
        ("pad", ctypes.c_long * 24),
    ]


for name, arguments in {
    "XInternAtom": [DISPLAY, ctypes.c_char_p, ctypes.c_int],
    "XDefaultRootWindow": [DISPLAY],
    "XCreateSimpleWindow": [DISPLAY, WINDOW] + [ctypes.c_int] * 2 + [ctypes.c_uint] * 3 + [ctypes.c_ulong] * 2,
    "XSendEvent": [DISPLAY, WINDOW, ctypes.c_int, ctypes.c_long, ctypes.POINTER(Event)],
    "XSetSelectionOwner": [DISPLAY, ATOM, WINDOW, ctypes.c_ulong],
    "XPending": [DISPLAY],
    "XNextEvent": [DISPLAY, ctypes.POINTER(Event)],
    "XFlush": [DISPLAY],
    "XCloseDisplay": [DISPLAY],
    "XChangeProperty": [DISPLAY, WINDOW, ATOM, ATOM, ctypes.c_int, ctypes.c_int, ctypes.c_char_p, ctypes.c_int],
}.items():
    getattr(X, name).argtypes = arguments
X.XInternAtom.restype = X.XDefaultRootWindow.restype = X.XCreateSimpleWindow.restype = ctypes.c_ulong


def drop(window, paths, patience_s=60):
    display = X.XOpenDisplay(None)
    assert display, "no display"
    atom = lambda name: X.XInternAtom(display, name.encode(), 0)
    source = X.XCreateSimpleWindow(display, X.XDefaultRootWindow(display), 0, 0, 1, 1, 0, 0, 0)
    uris = "".join("file://" + urllib.parse.quote(str(p)) + "\r\n" for p in paths).encode()

    def tell(message, *data):
        event = Event()
        event.client.type, event.client.window, event.client.message_type, event.client.format = (
            CLIENT_MESSAGE,
            window,
            atom(message),
            32,
        )
        for n, d in enumerate(data):
            event.client.data[n] = d
        X.XSendEvent(display, window, 0, 0, ctypes.byref(event))
        X.XFlush(display)

    X.XSetSelectionOwner(display, atom("XdndSelection"), source, 0)
    tell("XdndEnter", source, 5 << 24, atom("text/uri-list"))
    tell("XdndPosition", source, 0, 200 << 16 | 200, 0, atom("XdndActionCopy"))
    end, event, dropped, taken = time.monotonic() + patience_s, Event(), False, None
    while taken is None and time.monotonic() < end:
        if not X.XPending(display):
            time.sleep(0.01)
            continue
        X.XNextEvent(display, ctypes.byref(event))
        if event.type == CLIENT_MESSAGE and event.client.message_type == atom("XdndStatus") and not dropped:
            if not event.client.data[1] & 1:
                taken = False
            else:
                tell("XdndDrop", source, 0, 0)
                dropped = True
        elif event.type == CLIENT_MESSAGE and event.client.message_type == atom("XdndFinished"):
            taken = event.client.data[1] != 0  # GLFW 3.3 answers with the length of what it read, not with bit 0
        elif event.type == SELECTION_REQUEST:
            r = event.request
            X.XChangeProperty(display, r.requestor, r.property, r.target, 8, 0, uris, len(uris))
            answer = Event()
            answer.notify.type, answer.notify.requestor, answer.notify.selection = (
                SELECTION_NOTIFY,
                r.requestor,
                r.selection,
            )
            answer.notify.target, answer.notify.property, answer.notify.time = r.target, r.property, r.time
            X.XSendEvent(display, r.requestor, 0, 0, ctypes.byref(answer))
            X.XFlush(display)
    X.XCloseDisplay(display)
    return bool(taken)


def focus_away():
    """Another window gets the keys; returns what gives them to a window again."""
    X.XSetInputFocus.argtypes = [DISPLAY, WINDOW, ctypes.c_int, ctypes.c_ulong]
    X.XMapWindow.argtypes = [DISPLAY, WINDOW]
    X.XSync.argtypes = [DISPLAY, ctypes.c_int]
    display = X.XOpenDisplay(None)
    other = X.XCreateSimpleWindow(display, X.XDefaultRootWindow(display), 0, 0, 8, 8, 0, 0, 0)
    X.XMapWindow(display, other)
    X.XSync(display, 0)
    time.sleep(0.3)  # until it can be seen, it can have no keys
    X.XSetInputFocus(display, other, 1, 0)
    X.XSync(display, 0)

    def back(window):
        X.XSetInputFocus(display, window, 1, 0)
        X.XSync(display, 0)
        X.XCloseDisplay(display)

    return back
