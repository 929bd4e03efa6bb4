"""Cerebus packets by pycbsdk: read_cerebus.py VERSION PORT OUT.npz writes every sample it is called with and its time, until none comes for 3 s."""

import array, sys, time

version, port, out = sys.argv[1], int(sys.argv[2]), sys.argv[3]
import pycbsdk.cbhw.config

pycbsdk.cbhw.config.protocol = version
import numpy as np
from pycbsdk import cbsdk

device = cbsdk.get_device(
    cbsdk.create_params(
        inst_addr="127.0.0.1",
        inst_port=9,
        client_addr="127.0.0.1",
        client_port=port,
        recv_bufsize=64 << 20,
        protocol=version,
    )
)
rows, times, last = bytearray(), array.array("q"), [0.0]  # ten minutes are 18 million of them


def take(packet):
    rows.extend(np.asarray(packet.data, np.int16).tobytes())
    times.append(packet.header.time)
    last[0] = time.time()


if version == "3.11":  # whose headers have no instrument, which pycbsdk's own handler asks for
    from pycbsdk.cbhw.packet.common import CBPacketType

    device.unregister_config_callback(CBPacketType.SYSREP, device._handle_sysrep)
    device.register_config_callback(
        CBPacketType.SYSREP, lambda p: device.config.update(runlevel=p.runlevel, sysfreq=p.sysfreq)
    )
cbsdk.register_group_callback(device, 6, take)
cbsdk.connect(device, startup_sequence=False)  # nobody answers: what there is to know comes with the stream
print("listening", flush=True)
while last[0] == 0 or time.time() - last[0] < 3:
    time.sleep(0.1)
assert device.config["runlevel"] == 50 and device.config["sysfreq"] == 30000, device.config
times = np.frombuffer(times, np.int64)
np.savez(out, rows=np.frombuffer(bytes(rows), np.int16).reshape(len(times), -1), times=times)
