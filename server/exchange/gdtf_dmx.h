// DMX -> physical values of a fixture, and from them what its beams do. Pure; any thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "server/exchange/gdtf.h"

namespace gonio::gdtf {

// Of each break the bytes from the fixture's first slot on. A channel whose slots are not all there has its default.
using DmxBytes = std::map<int, std::vector<std::uint8_t>>;

// What a channel says at one geometry.
struct ChannelValue {
    int patched = 0;    // index into Mode::patched
    int function = -1;  // the active one; -1: none is
    int set = -1;       // of the function; -1: none begins so low
    std::uint32_t dmx = 0;
    double ratio = 0.0;     // of the function's range, 0..1, after its DMX profile
    double physical = 0.0;  // from physical_from to physical_to, or those of the set where it has its own
};

// Result: a value for each of mode.patched. Of the functions whose mode master lets them, the one with the greatest
// DMXFrom that is not above the value is active.
std::vector<ChannelValue> channel_values(const FixtureType& type, const Mode& mode, const DmxBytes& bytes);
// Result: that of one of mode.patched at these values, while all others are as in `others`: of default_values().
std::vector<ChannelValue> values_of_channel(const FixtureType& type, const Mode& mode, int patched,
                                            std::span<const std::uint32_t> dmx,
                                            const std::vector<ChannelValue>& others);
// Result: likewise with the defaults of all channels.
std::vector<ChannelValue> default_values(const FixtureType& type, const Mode& mode);

// A DMX profile's output of x, both 0..1: the piece with the greatest DMXPercentage <= x; 0 where there is none.
double profile_output(const DmxProfile& profile, double x);

// Whether the attribute adds light of a colour: ColorAdd_…, and ColorRGB_Red, _Green, _Blue in modes without those,
// which mix_by_rgb() tells.
bool adds_light(std::string_view attribute, bool by_rgb);
bool mix_by_rgb(const Mode& mode);
// Result: the colour of a function's emitter or filter, else of its attribute: the file's own or the standard's. So is
// the luminance of an emitter of which only a wavelength is known.
Color color_of_function(const FixtureType& type, const ChannelFunction& function);
// Result: linear Rec.709 of the colour, its luminance as the share that passes or shines.
glm::dvec3 rgb_of(const Color& color);
// Result: likewise of an emitter's, with components below 0 for what Rec.709 lacks.
glm::dvec3 wide_rgb_of(const Color& color);
// Result: what the slot that a set of a function chooses lets through; 1 where it has no colour, or there is none.
glm::dvec3 slot_filter(const FixtureType& type, const ChannelFunction& function, int set);
// Result: a component of 0 to 1, clamped; of a function whose physical values go beyond 1.5 the share of the greatest.
double component(const ChannelFunction& function, double physical);

struct GoboState {
    int number = 1;            // of Gobo1, Gobo2, …
    int wheel = -1, slot = 0;  // indices; the slot's picture may be empty
    double angle_rad = 0.0;    // Gobo(n)Pos
};

struct BeamState {
    int geometry = 0;                   // index into Mode::geometries
    glm::dmat4 fixture_from_beam{1.0};  // with pan and tilt; the beam goes along -Z
    double dimmer_ratio = 1.0;          // the product of all from the root to the beam
    glm::dvec3 color{1.0};              // linear Rec.709; its luminance is the share of the flux that passes
    double white_k = 0.0;               // the colour temperature whose white is a factor of it; 0: none is
    std::optional<double> zoom_rad;     // the full angle; none: the beam's own
    bool shutter_open = true;
    double strobe_hz = 0.0;  // 0: it does not flash
    std::vector<GoboState> gobos;
};

struct StateOptions {
    bool invert_pan = false, invert_tilt = false;  // MVR's DMXInvertPan, DMXInvertTilt
    // Instead of what the channels say; positive pan is counter-clockwise seen from above.
    std::optional<double> pan_rad, tilt_rad;
};

// Result: a state for each beam of the mode's tree, in its order. Attributes act on the channel's geometry and on all
// below it; docs/shows.md has the table of what each does. A Zoom or temperature whose physical range is 0..1, or that
// no lamp has, was never filled in: it does nothing.
std::vector<BeamState> beam_states(const FixtureType& type, const Mode& mode, const std::vector<ChannelValue>& values,
                                   const StateOptions& options = {});

}  // namespace gonio::gdtf
