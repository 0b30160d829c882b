"""Our engines: name in the plugin's attribute `engine` -> name in the tables, and how far its numbers may be off.

The one place to switch an engine on or off.
"""

ENGINES = {
    "fused": ("hydro, f32", 1e-4),
    # Over 64 samples of a random field, which forgets nothing, the rounding adds up; `evaluate` reports what it is.
    "fused-f16": ("hydro, f16", 1e-1),
    "fused-i16": ("hydro, int16", 1e-1),
}
#: The reference among ours, timed as an implementation of its own.
CANDLE = ("candle", "hydro, Candle engine", 1e-4)
F32, F16, I16 = "hydro, f32", "hydro, f16", "hydro, int16"
