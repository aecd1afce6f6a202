// GDTF 1.2 fixture types of our own: a body, where its head turns a yoke and a head, one beam and one mode. Pure.
#pragma once

#include <string>
#include <vector>

#include "ies/core/result.h"

namespace gonio::gdtf {

inline constexpr const char* kWrittenMode = "Default";

// A channel of the mode. It is at the yoke (Pan), the head (Tilt) or the body.
struct WrittenChannel {
    std::string attribute;  // Dimmer, Pan, Tilt, ColorAdd_R, ColorAdd_G, ColorAdd_B
    int dmx_break = 1;
    int slot = 0;  // the first, from 1; 0: none, it is virtual
    int bytes = 1;
    double from = 0.0, to = 1.0;  // physical: ratios, degrees
    double value = 0.0;           // by default, likewise
    bool operator==(const WrittenChannel&) const = default;
};

struct WrittenType {
    std::string name;       // as GDTF allows it: gdtf_name()
    std::string id;         // UUID
    bool has_head = false;  // pan and tilt axes; else the beam is fixed to the body
    double roll_rad = 0.0;  // of the beam about its own direction
    double flux_lm = 0.0, beam_angle_deg = 0.0, field_angle_deg = 0.0, radius_m = 0.0, power_w = 0.0;
    std::vector<WrittenChannel> channels;
};

// Result: the text with what GDTF allows in names alone, at most 64 bytes; "fixture" where nothing is left.
std::string gdtf_name(const std::string& text);
// Result: the XML of the type's description.
std::string write_description(const WrittenType& type);
// Result: the node of a channel's function, as custom commands name it: "Yoke_Pan.Pan.Pan 1".
std::string function_node(const std::string& attribute);

}  // namespace gonio::gdtf
