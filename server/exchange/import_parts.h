// The parts of the import of MVR shows.
#pragma once

#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "ies/core/zip.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/text/shortened_text.h"
#include "server/assets/assets.h"
#include "server/exchange/gdtf_dmx.h"
#include "server/exchange/mvr.h"

namespace gonio::exchange {

// What is looked up of a mode for each of its fixtures.
struct ModeIndex {
    bool has_beam = false;
    std::multimap<int, const gdtf::PatchedChannel*> channels_of;   // by geometry; those that have slots
    std::multimap<int, const gdtf::ChannelFunction*> emitters_of;  // ColorAdd, likewise
    // Directions of beams by geometry, at the pans and tilts of head_axes(), for each inversion that was asked for.
    std::map<std::pair<bool, bool>, std::vector<std::map<int, glm::dvec3>>> directions;
    bool told_undriven = false;
};

// What one import has gathered so far.
struct ShowImport {
    const ZipArchive& archive;
    const mvr::EntryIndex& entries;
    const mvr::Show& show;
    const LoadOptions& options;
    SceneAsset& scene;
    std::size_t room;  // bytes that may still be taken (take_memory)
    ImportReport report{};
    v1::SetPatch patch{};

    std::map<std::string, std::optional<gdtf::FixtureType>> types{};   // by entry; nothing: unreadable
    std::map<std::string, std::shared_ptr<const Profile>> profiles{};  // by what they were made of
    std::set<std::string, std::less<>> light_names{};
    std::map<const gdtf::Mode*, ModeIndex> modes{};
    std::size_t instanced = 0;  // triangles of all instances
};

// Whether a place is finite and within the 1,000 km that clients may ask for too.
inline constexpr double kMostPlace_m = 1e6;
inline bool is_within(const glm::dvec3& place) {
    return std::abs(place.x) <= kMostPlace_m && std::abs(place.y) <= kMostPlace_m && std::abs(place.z) <= kMostPlace_m;
}

// Result: what an import report names of a file of the archive that cannot be read.
inline std::string named(const std::string& entry, const Error& error) {
    return shortened_text(entry + " (" + error.text() + ")", 300);
}

// Adds the instances of the show's models. Errors: "too_large"; models that cannot be read are left out by name.
std::optional<Error> import_models(ShowImport& import);
// Adds a light for each beam of each fixture, and the rows of its patch.
std::optional<Error> import_fixtures(ShowImport& import);

// A beam of a fixture as a light.
struct FixtureBeam {
    const mvr::Fixture& fixture;
    const gdtf::FixtureType& type;
    const gdtf::Mode& mode;
    int geometry;                   // the beam
    glm::dmat4 world_from_fixture;  // of GDTF's axes
    std::string light;              // its name
};
// Adds the rows that drive the light: level, red, green and blue, pan and tilt, as far as the scene has such a
// property. Result: whether pan or tilt is driven.
bool add_patch_rows(ShowImport& import, const FixtureBeam& beam);

// How a console's pan and tilt become the light's: pan_rad = offset + sign · GDTF's, likewise tilt.
struct HeadAxes {
    double pan_offset_rad = 0.0, pan_sign = 1.0, tilt_offset_rad = 0.0, tilt_sign = 1.0;
};
// Result: where the beams of the mode go in its own axes, at each pair of pan and tilt that head_axes() looks at.
std::vector<std::map<int, glm::dvec3>> head_directions(const gdtf::FixtureType& type, const gdtf::Mode& mode,
                                                       bool invert_pan, bool invert_tilt);
// directions: those, of the beam's fixture. has_pan: else only its tilt turns. Result: the axes of a fixture that hangs
// or stands upright; nothing where it is mounted otherwise, or where its axes are not a tilt below a pan.
std::optional<HeadAxes> head_axes(const std::vector<std::map<int, glm::dvec3>>& directions, int beam_geometry,
                                  const glm::dmat4& world_from_fixture, bool has_pan);

// Result: the index of a mode, made once.
ModeIndex& index_of(ShowImport& import, const gdtf::Mode& mode);

}  // namespace gonio::exchange
