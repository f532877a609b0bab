"""A parser of VTK's .vtp files of its own: Python's standard library alone."""
import base64
import math
import struct
import xml.etree.ElementTree as xml
import zlib

TYPES = {"Float64": "d", "Float32": "f", "Int64": "q", "Int32": "i", "UInt8": "B", "UInt32": "I"}


def decoded(text, kind, header):
    """The numbers of an inline binary array of VTK's XML, packed by zlib or not."""
    raw, word = text.strip(), struct.calcsize(header)
    size = struct.unpack("<" + header, base64.b64decode(raw[:16])[:word])[0]
    length = 4 * math.ceil((3 + size) * word / 3)
    blocks = struct.unpack(f"<{3 + size}{header}", base64.b64decode(raw[:length])[:(3 + size) * word])
    data, at, values = base64.b64decode(raw[length:]), 0, b""
    for block in blocks[3:]:
        values += zlib.decompress(data[at:at + block])
        at += block
    return struct.unpack(f"<{len(values) // struct.calcsize(kind)}{kind}", values)


def read_vtp(path):
    """Points, lines, and arrays of a .vtp file by their names."""
    root = xml.parse(path).getroot()
    header = "Q" if root.get("header_type") == "UInt64" else "I"
    arrays = {}
    for element in root.iter("DataArray"):
        kind = TYPES[element.get("type")] if element.get("type") in TYPES else None
        if kind is None or not (element.text or "").strip():
            continue
        values = decoded(element.text, kind, header) if element.get("format") == "binary" else None
        width = int(element.get("NumberOfComponents", "1"))
        if values is not None:
            rows = [values[n:n + width] for n in range(0, len(values), width)] if width > 1 else list(values)
            arrays.setdefault(element.get("Name"), rows)
    lines = root.find(".//Lines")
    where = {e.get("Name"): decoded(e.text, TYPES[e.get("type")], header) for e in lines if (e.text or "").strip()}
    ends = list(where["offsets"])
    cells = [where["connectivity"][a:b] for a, b in zip([0] + ends, ends)]
    return arrays, cells
