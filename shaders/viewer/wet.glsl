// Put before crown.frag where the surface may be wet: costs as much again as the dry highlights.
#define WET
