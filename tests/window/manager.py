"""What a window manager does with a window that is put away, by Xlib alone: it is unmapped and has ICCCM's WM_STATE of an icon.
usage: put_away(WINDOW_ID), bring_back(WINDOW_ID) with DISPLAY set"""

import ctypes

X = ctypes.CDLL("libX11.so.6")
DISPLAY, ATOM, WINDOW = ctypes.c_void_p, ctypes.c_ulong, ctypes.c_ulong
X.XOpenDisplay.restype = DISPLAY
X.XInternAtom.restype = ATOM
for name, arguments in {
    "XOpenDisplay": [ctypes.c_char_p],
    "XInternAtom": [DISPLAY, ctypes.c_char_p, ctypes.c_int],
    "XChangeProperty": [DISPLAY, WINDOW, ATOM, ATOM, ctypes.c_int, ctypes.c_int, ctypes.c_void_p, ctypes.c_int],
    "XMapWindow": [DISPLAY, WINDOW],
    "XUnmapWindow": [DISPLAY, WINDOW],
    "XSync": [DISPLAY, ctypes.c_int],
    "XCloseDisplay": [DISPLAY],
}.items():
    getattr(X, name).argtypes = arguments
NORMAL, ICON = 1, 3


def set_state(window, state):
    display = X.XOpenDisplay(None)
    assert display, "no display"
    wm_state = X.XInternAtom(display, b"WM_STATE", 0)
    values = (ctypes.c_ulong * 2)(state, 0)  # a format of 32 bits is handed over as longs
    (X.XMapWindow if state == NORMAL else X.XUnmapWindow)(display, int(window))
    X.XChangeProperty(display, int(window), wm_state, wm_state, 32, 0, ctypes.byref(values), 2)
    X.XSync(display, 0)
    X.XCloseDisplay(display)


def put_away(window):
    set_state(window, ICON)


def bring_back(window):
    set_state(window, NORMAL)
