#include "protocol/schema/property.h"

#include <numbers>

namespace gonio {

static constexpr double kPi = std::numbers::pi;
static constexpr double kDegree = kPi / 180.0;

// Limits are those of server/scene/apply.cpp, which a unit test compares.
// Pan and tilt: the usual travel of moving heads, 540 and 270 degrees.
static constexpr PropertyRow kTable[] = {
    {Property::level, "level", 1, false, true, true, 0, 1, 0, 1, 1},
    {Property::red, "red", 1, false, false, true, 0, 1, 0, 1e4, 1},
    {Property::green, "green", 1, false, false, true, 0, 1, 0, 1e4, 1},
    {Property::blue, "blue", 1, false, false, true, 0, 1, 0, 1e4, 1},
    {Property::color, "color", 3, false, false, true, 0, 1, 0, 1e4, 1},
    {Property::pan, "pan", 1, false, false, true, -1.5 * kPi, 1.5 * kPi, -64 * kPi, 64 * kPi, kDegree},
    {Property::tilt, "tilt", 1, false, false, true, -0.75 * kPi, 0.75 * kPi, -64 * kPi, 64 * kPi, kDegree},
    {Property::roll, "roll", 1, false, false, true, -kPi, kPi, -64 * kPi, 64 * kPi, kDegree},
    {Property::x, "x", 1, false, false, false, 0, 0, -1e6, 1e6, 1},
    {Property::y, "y", 1, false, false, false, 0, 0, -1e6, 1e6, 1},
    {Property::z, "z", 1, false, false, false, 0, 0, -1e6, 1e6, 1},
    {Property::position, "position", 3, false, false, false, 0, 0, -1e6, 1e6, 1},
    {Property::aim, "aim", 3, false, false, true, -1, 1, -1e6, 1e6, 1},
    {Property::profile, "profile", 1, false, false, true, 0, 1, 0, 1, 1, true},
    {Property::master, "master", 1, true, true, true, 0, 1, 0, 1, 1},
    {Property::exposure, "exposure", 1, true, false, true, 0, 15, -10, 24, 1},
    // Azimuth from +Z towards +X, height above the horizontal, metres. Straight up and down the camera has no azimuth.
    {Property::orbit, "orbit", 1, true, false, true, -kPi, kPi, -64 * kPi, 64 * kPi, kDegree, false, true},
    {Property::elevation, "elevation", 1, true, false, true, -kPi / 3, kPi / 3, -89 * kDegree, 89 * kDegree, kDegree,
     false, true},
    {Property::distance, "distance", 1, true, false, false, 0, 0, 1e-3, 1e6, 1, false, true},
    {Property::preset, "preset", 1, true, false, true, 0, 1, 0, 1, 1, true},
};

std::span<const PropertyRow> property_table() {
    return kTable;
}

const PropertyRow& row_of(Property property) {
    return kTable[static_cast<std::size_t>(property)];
}

const PropertyRow* find_property(std::string_view name) {
    for (const PropertyRow& row : kTable)
        if (row.name == name) return &row;
    return nullptr;
}

}  // namespace gonio
