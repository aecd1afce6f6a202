// The parts of the import of MVR shows.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "ies/core/zip.h"
#include "protocol/schema/console.pb.h"
#include "protocol/text/shortened_text.h"
#include "server/assets/assets.h"
#include "server/exchange/gdtf_dmx.h"
#include "server/exchange/mvr.h"
#include "server/scene/body.h"
#include "server/scene/imported.h"

namespace gonio::exchange {

inline constexpr double kDegree = std::numbers::pi / 180.0;  // of the files, in radians

// A model that was read once: meshes of a scene with their places, of Y up.
struct Model {
    struct Part {
        int mesh;
        int mirrored = -1;  // its copy that faces the front where it is turned inside out
        glm::dmat4 model_from_mesh{1.0};
        std::optional<std::array<glm::dvec3, 2>> box{};  // of the mesh, with its origin; found at its first use
    };
    std::vector<Part> parts;
};

// A geometry that a console turns: its pan about Z, its tilt about X.
struct Turn {
    int geometry = 0;
    bool tilt = false;
    bool operator==(const Turn&) const = default;
};

// What is looked up of a mode for each of its fixtures.
struct ModeIndex {
    bool has_beam = false;
    std::multimap<int, const gdtf::PatchedChannel*> channels_of;   // by geometry; those that have slots
    std::multimap<int, const gdtf::ChannelFunction*> emitters_of;  // ColorAdd, likewise
    // Directions of beams by geometry, at the pans and tilts of head_axes(), for each inversion that was asked for.
    std::map<std::pair<bool, bool>, std::vector<std::map<int, glm::dvec3>>> directions;
    const gdtf::FixtureType* patched_type = nullptr;  // of a fixture of this mode that is patched; null: none is
    std::set<std::pair<int, std::string>> driven;     // channels and attributes that have rows
    std::vector<gdtf::ChannelValue> defaults;         // of gdtf::default_values()
    std::vector<std::vector<Turn>> turns;  // by geometry: those that turn it, from the root on, itself among them
    // What values of a channel's most significant slot stand for, by the patched channel, the beam and the property.
    std::map<std::tuple<const gdtf::PatchedChannel*, int, std::string>, std::vector<v1::PatchRange>> ranges;
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
    std::map<const gdtf::FixtureType*, std::map<int, std::shared_ptr<const Gobos>>> gobos{};  // by wheel
    std::set<std::string, std::less<>> light_names{};
    std::map<const gdtf::Mode*, ModeIndex> modes{};
    std::size_t instanced = 0;                                          // triangles of all instances
    std::shared_ptr<Bodies> bodies{};                                   // null: none yet
    std::map<const gdtf::FixtureType*, std::map<int, Model>> models{};  // of bodies, by FixtureType::models
    std::size_t body_triangles = 0;                                     // of all parts
    std::size_t state_steps = 0;                                        // channels and geometries of all states found
    Imported imported{};                                                // like the scene's lights
    std::vector<const mvr::Fixture*> fixture_of{};                      // likewise
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

// bytes: a .glb or a .3ds. scene: that gets its meshes, materials and images. Result: those, in metres, Y up. The
// report names faces that were left out, and a model without any. Errors: of read_glb and read_3ds.
Result<Model> take_model(ShowImport& import, SceneAsset& scene, const std::string& bytes, const std::string& entry);
// Result: the corners of a mesh's box, with its origin in it.
std::array<glm::dvec3, 2> box_of(const Mesh& mesh);
// Whether such a box, brought by the matrix, is finite and within 1,000 km, and the matrix spans a space.
bool is_placed(const glm::dmat4& matrix, const std::array<glm::dvec3, 2>& box);

// A web of a file and its tables take at most so much for each byte of the file: a value has two characters.
inline constexpr std::size_t kBytesPerFileByte = 8;
// Reads the files that Beam@Photometric names. One that cannot be read is noted, and flux and angles count.
void read_photometric(ShowImport& import, const ZipArchive& archive, const gdtf::FixtureType& type);
// Result: that of the beam; null where it names none, or one that cannot be read.
std::shared_ptr<const Profile> photometric_profile(const ShowImport& import, const gdtf::FixtureType& type,
                                                   const gdtf::Beam& beam);

// Adds the instances of the show's models. Errors: "too_large", of all of them together. A model that cannot be read,
// by itself or in the memory that is left, is left out by name.
std::optional<Error> import_models(ShowImport& import);
// Adds a light for each beam of each fixture, and the rows of its patch.
std::optional<Error> import_fixtures(ShowImport& import);

// Of the light that was added last: which fixture it is of, for the show's next edition. beam: of several.
void note_imported(ShowImport& import, const mvr::Fixture& fixture, const std::string& beam);
// Once all lights are there: the show's groups, layers, classes and positions that have lights, at most so many: a
// scene has kMaxGroups, and a person wants some.
inline constexpr std::size_t kMostShowGroups = 48;
void import_groups(ShowImport& import);

// A beam of a fixture as a light.
struct FixtureBeam {
    const mvr::Fixture& fixture;
    const gdtf::FixtureType& type;
    const gdtf::Mode& mode;
    int geometry;                   // the beam
    glm::dmat4 world_from_fixture;  // of GDTF's axes
    std::string light;              // its name
};
// How a console's pan and tilt become the light's: pan_rad = offset + sign · GDTF's, likewise tilt.
struct HeadAxes {
    double pan_offset_rad = 0.0, pan_sign = 1.0, tilt_offset_rad = 0.0, tilt_sign = 1.0;
    glm::dquat world_from_mount{1.0, 0.0, 0.0, 0.0};  // Light::world_from_mount
};
// Adds the rows that drive the light: level, red, green and blue, cct, shutter, strobe, zoom, gobo, pan and tilt. Where
// filters or wheels make its colour, they go beside the light's cct. Result: the axes where pan or tilt is driven.
std::optional<HeadAxes> add_patch_rows(ShowImport& import, const FixtureBeam& beam);
// Once all fixtures have their rows: what of their modes has none, by name.
void note_undriven(ShowImport& import);

// A channel that drives something of a beam: that of the nearest geometry, from the beam upwards.
struct Driving {
    const gdtf::PatchedChannel* patched = nullptr;  // null: there is none
    const gdtf::ChannelFunction* function = nullptr;
    int bytes = 1;  // of the channel
};
using Wanted = std::function<bool(std::string_view attribute)>;
// Result: the channels with a function whose attribute is wanted, from the beam upwards, and the first of them.
std::vector<Driving> all_driving(const ModeIndex& index, const FixtureBeam& beam, const Wanted& wanted);
Driving driving(const ModeIndex& index, const FixtureBeam& beam, const Wanted& wanted);
// What a row makes of its slots.
struct Drive {
    const char* property;
    double low = 0.0, high = 0.0;          // of slot value 0 and the highest
    std::vector<v1::PatchRange> ranges{};  // instead of them, of the channel's most significant slot alone
    const char* merge = "";                // PatchRow::merge
    bool wide_ranges = false;              // they are of 16 bits
};
// Adds a row of the patch. The attributes of its channel that are wanted are driven by it.
void add_row(ShowImport& import, const FixtureBeam& beam, const Driving& by, const Wanted& wanted, const Drive& drive);
// What a value of a channel says of a property; nothing where it leaves it alone.
using ReadValue = std::function<std::optional<double>(const gdtf::ChannelFunction& active, double physical)>;
// Likewise of the beam's state then.
using ReadState = std::function<std::optional<double>(const gdtf::BeamState&)>;
// Adds a row of ranges: what each value of the most significant slot says while all other channels have their defaults.
// States are found for kMostStateSteps channels and geometries in all; what comes later is left out, by name. What is
// read, for what, by which channel and merged how: eight parameters.
inline constexpr std::size_t kMostStateSteps = 50'000'000;  // some seconds
using ReadChannel = std::function<std::optional<double>(const gdtf::ChannelValue&)>;
void add_channel_ranges(ShowImport& import, ModeIndex& index, const FixtureBeam& beam, const Driving& by,
                        const Wanted& wanted, const char* property, const ReadChannel& read, const char* merge);
void add_ranges(ShowImport& import, ModeIndex& index, const FixtureBeam& beam, const Driving& by, const Wanted& wanted,
                const char* property, const ReadValue& read, const char* merge = "");
void add_state_ranges(ShowImport& import, ModeIndex& index, const FixtureBeam& beam, const Driving& by,
                      const Wanted& wanted, const char* property, const ReadState& read);
// Whether one function has the whole channel, in a straight line: then all of its bytes count.
bool is_line(const FixtureBeam& beam, const Driving& by);
// Whether a function of the channel that is wanted has other physical values than the standard's defaults, 0 and 1.
bool is_filled_in(const FixtureBeam& beam, const Driving& by, const Wanted& wanted);
// Adds the rows for shutter, strobe, zoom, gobo and its turn.
void add_beam_rows(ShowImport& import, ModeIndex& index, const FixtureBeam& beam);

// Reads the pictures of a fixture type's gobo wheels: at most 255 slots a wheel and 64 pictures. They are of at most
// 2048 x 2048 pixels and become 256 x 256 at most, when they are first shown: only their headers are read here. What
// cannot be read is open, and noted.
void read_gobos(ShowImport& import, const ZipArchive& archive, const gdtf::FixtureType& type);
struct GoboChannel {
    int number = 0, wheel = -1;  // of Gobo(n); an index, -1: none has a picture
};
// Result: of those that the beam's channels turn the one of the least number whose wheel has a picture.
GoboChannel gobo_channel(const ShowImport& import, const ModeIndex& index, const FixtureBeam& beam);
// Result: the profile with the wheel's gobos, made once; the same where there are none.
std::shared_ptr<const Profile> with_gobos(ShowImport& import, const std::shared_ptr<const Profile>& profile,
                                          const gdtf::FixtureType& type, int wheel);
// Result: the profile behind the picture that the show itself gives the fixture, turned as it says. It is the same
// where there is none; one that cannot be read is noted.
std::shared_ptr<const Profile> with_own_gobo(ShowImport& import, const std::shared_ptr<const Profile>& profile,
                                             const mvr::Fixture& fixture);

// Result: where the beams of the mode go in its own axes, at each pair of pan and tilt that head_axes() looks at.
std::vector<std::map<int, glm::dvec3>> head_directions(const gdtf::FixtureType& type, const gdtf::Mode& mode,
                                                       bool invert_pan, bool invert_tilt);
// How a head hangs in its fixture, and which of its axes turn.
struct Head {
    glm::dmat4 fixture_from_mount{1.0};  // what stays still below its axes
    bool has_pan = true, has_tilt = true;
};
// directions: those, of the beam's fixture. Result: the axes; nothing where they are not a tilt below a pan, square to
// each other and to the beam.
std::optional<HeadAxes> head_axes(const std::vector<std::map<int, glm::dvec3>>& directions, int beam_geometry,
                                  const glm::dmat4& world_from_fixture, const Head& head = {});

// Result: a mesh for a model's PrimitiveType ("Cube", "Yoke", "Base1_1"), of Y up, about as large as 1 m; nothing where
// there is no such type.
std::optional<Mesh> primitive_mesh(std::string_view primitive);
// Reads the models that a fixture type's geometries show, into the meshes of bodies; a primitive that has no file of
// its own is primitive_mesh(). What cannot be read or has no mesh is left out, by name.
void read_body_models(ShowImport& import, const ZipArchive& archive, const gdtf::FixtureType& type);
// A light of a fixture, as its body follows it.
struct BodyLight {
    int geometry = 0;                     // the beam
    std::size_t seed = 0;                 // index into SceneAsset::lights
    glm::dquat home{1.0, 0.0, 0.0, 0.0};  // world_from_light before a focus point turned it
    std::optional<HeadAxes> axes;         // of a console's pan and tilt
};
struct FixtureBody {
    const gdtf::FixtureType& type;
    const gdtf::Mode& mode;
    glm::dmat4 world_from_fixture;  // of GDTF's axes
    double pan_rad;                 // of the fixture, as its lights aim
    std::string name;
};
// Adds the body of a fixture: a part for each mesh of each geometry's model. It follows the first light whose beam lies
// below what turns the geometry. Beyond kMostBodyParts and kMostBodyTriangles parts are left out, by name.
void add_body(ShowImport& import, const FixtureBody& fixture, std::span<const BodyLight> lights);
// The rotation of a matrix, its lengths and any mirroring left out.
glm::dquat turn_of(const glm::dmat4& matrix);

// Result: the index of a mode, made once.
ModeIndex& index_of(ShowImport& import, const gdtf::Mode& mode);
// Result: its ModeIndex::turns, made once; at most kMostJoints of a geometry.
const std::vector<std::vector<Turn>>& turns_of(ModeIndex& index, const gdtf::Mode& mode);

}  // namespace gonio::exchange
