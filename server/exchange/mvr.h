// MVR 1.4 to 1.6 (DIN SPEC 15801): a show as a value. Matrices are in the scene's axes and metres on both sides: an
// object's own axes are Y up too. Pure; any thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "ies/core/result.h"
#include "ies/core/zip.h"
#include "server/exchange/import_report.h"

namespace gonio::mvr {

inline constexpr std::size_t kMaxObjects = 100'000;  // with those of symbols, each time they are shown: "too_large"
inline constexpr int kMaxDepth = 64;                 // of objects and symbols; deeper ones are left out
inline constexpr unsigned kMostUniverse = 63'999;    // sACN's
inline constexpr const char* kProvider = "gonio";    // that wrote a show itself, and its user data

// What an .mvr may unpack to.
inline constexpr ZipLimits kMvrLimits{.archive_bytes = std::uint64_t{1} << 30,
                                      .entries = 10'000,
                                      .total_bytes = std::uint64_t{4} << 30,
                                      .entry_bytes = 256u << 20};

struct ReadOptions {
    int universe_offset = 0;  // added to MVR's universes, which count from 1
};

struct Named {
    std::string uuid, name;
};

enum class ObjectKind : std::uint8_t {
    scene_object,
    group,
    focus_point,
    fixture,
    support,
    truss,
    video_screen,
    projector,
};

struct Object {
    ObjectKind kind = ObjectKind::scene_object;
    std::string name, uuid;
    int layer = -1;
    int parent = -1;        // before it in the list
    int object_class = -1;  // index into Show::classes
    glm::dmat4 world_from_object{1.0};
};

// A model file where it is shown.
struct ModelUse {
    int object = 0;
    std::string entry;                 // of the archive
    glm::dmat4 world_from_model{1.0};  // of a model in metres, Y up: a glTF as it is
};

struct Patch {
    int dmx_break = 1;  // from 1, as in GDTF
    unsigned universe = 1, address = 1;
    bool operator==(const Patch&) const = default;
};

// What user data of Gonio say beside the standard: the light as it was, where no console speaks.
struct FixtureState {
    double level_ratio = 1.0, multiplier = 1.0;
    std::array<double, 3> color{1.0, 1.0, 1.0};  // linear Rec.709
};

struct Fixture {
    int object = 0;
    std::string spec;   // as written
    std::string entry;  // of the archive, a .gdtf; empty: none
    std::string mode;   // as written; may be empty
    std::string fixture_id, custom_id, unit_number;
    std::optional<long long> fixture_id_numeric;
    std::string position;  // the name of the Position that it hangs at
    int focus = -1;        // index into Show::focus_points
    std::vector<Patch> patches;
    std::string gobo;       // entry of the archive, a picture that goes before those of its wheels; empty: none
    double gobo_rad = 0.0;  // counter-clockwise, seen from the fixture
    bool invert_pan = false, invert_tilt = false, casts_shadow = true;
    std::optional<std::array<double, 3>> color;  // CIE xyY of the label (a gel), Y in percent
    std::vector<std::string> commands;           // CustomCommand
    std::optional<FixtureState> state;
};

struct FocusPoint {
    int object = 0;
    glm::dvec3 position{0.0};  // world
};

struct Show {
    std::string provider, version;  // who wrote it; "1.5"
    std::vector<Named> layers, classes, positions, symbols;
    std::vector<Object> objects;
    std::vector<ModelUse> models;
    std::vector<Fixture> fixtures;
    std::vector<FocusPoint> focus_points;
    exchange::ImportReport report;
};

// xml: GeneralSceneDescription.xml. entries: the names of the archive's files. What refers to something that is not
// there, contains itself or lies too deep is left out, and the report names it. Errors: "bad_mvr" (not XML, no scene),
// "too_large".
Result<Show> read_show(std::string_view xml, std::span<const std::string> entries, const ReadOptions& options = {});
// Of an .mvr that was opened. Errors: also those of its archive.
Result<Show> read_mvr(const ZipArchive& archive, const ReadOptions& options = {});

// The names of an archive's files, to be found as shows write them. The names must outlive it.
class EntryIndex {
public:
    explicit EntryIndex(std::span<const std::string> entries);
    struct Found {
        std::string entry;  // empty: there is none
        bool as_written = false;
    };
    // Result: the entry of this name, with the extension where the name has another one or none; else one that differs
    // by case, folders or blanks only. Backslashes are slashes. None where the name is nothing but an extension.
    Found find(std::string_view name, std::string_view extension) const;

private:
    std::map<std::string, std::string, std::less<>> exact_, loose_;
};

// Result: "1F0C9F5B-…" of 32 hexadecimal digits however they are grouped; any other text as it is.
std::string plain_uuid(std::string_view text);

// text: "U.A", or (U - 1) · 512 + A. Result: universe and address, both from 1; nothing where the text is neither, or
// says 0: not patched.
struct Address {
    unsigned universe = 1, address = 1;
};
std::optional<Address> address_of(std::string_view text);

}  // namespace gonio::mvr
