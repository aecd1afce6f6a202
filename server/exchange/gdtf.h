// GDTF 1.1 and 1.2 (DIN SPEC 15800): a fixture type as a value. Axes of the file: right-handed, Z up, metres; the
// device hangs, a beam goes along -Z, its picture's up is +Y. Pure; any thread.
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
#include <utility>
#include <vector>

#include "ies/core/result.h"
#include "ies/core/zip.h"
#include "server/exchange/import_report.h"

namespace gonio::gdtf {

inline constexpr std::size_t kMaxGeometries = 100'000;     // of all modes, references expanded: "too_large"
inline constexpr std::size_t kMaxChannels = 100'000;       // likewise, one for each geometry that it stands for
inline constexpr std::size_t kMaxFunctions = 400'000;      // of all channels with their sets: likewise
inline constexpr std::size_t kMaxChannelFunctions = 4096;  // of one channel: likewise
inline constexpr std::size_t kMaxItems = 4096;  // models; wheels with slots; emitters, filters, …: likewise
inline constexpr int kMaxDepth = 64;            // of geometries; deeper ones are left out
inline constexpr std::size_t kMaxBreaks = 512;  // of a reference: "too_large"
inline constexpr int kMaxChannelBytes = 4;
inline constexpr int kMostSlot = 512;  // of a break

// CIE 1931 x, y, and Y in percent.
struct Color {
    double x = 0.3127, y = 0.3290, luminance_percent = 100.0;  // below 0: that of the function's attribute
};

// A value of the file, or its default.
template <typename T>
struct Given {
    T value{};
    bool defaulted = true;
};

enum class BeamType : std::uint8_t { wash, spot, none, rectangle, pc, fresnel, glow };

struct Beam {
    Given<double> flux_lm{10000.0};
    Given<double> beam_angle_rad{0.436332312998582};   // the full angle, of half the peak
    Given<double> field_angle_rad{0.436332312998582};  // likewise, of a tenth
    Given<double> color_temperature_k{6000.0};
    Given<double> radius_m{0.05};
    Given<double> throw_ratio{1.0}, rectangle_ratio{1.7777}, color_rendering_index{100.0}, power_w{1000.0};
    Given<BeamType> type{BeamType::wash};
    Given<std::string> lamp_type{"Discharge"};
    std::string photometric;  // entry of the archive, an .ies or .ldt, which goes before flux and angles; empty: none
    bool guessed = false;     // the file has no beam: GDTF's defaults stand for it
};

struct Model {
    std::string name;
    glm::dvec3 size_m{0.0};  // Length (X), Width (Y), Height (Z), to which its mesh is scaled
    std::string primitive;   // PrimitiveType; empty: Undefined
    std::string file;        // as the fixture type says, without folder and extension; empty: none
    std::string entry;       // of the archive, .glb or .3ds; empty: none
};

enum class GeometryKind : std::uint8_t { plain, axis, beam, media_server, display, laser, other };

// A node of a mode's tree. A reference is a node with the children of what it refers to.
struct Geometry {
    std::string name;
    std::string source;  // the name of the geometry that it was made from: `name` but for references
    GeometryKind kind = GeometryKind::plain;
    int parent = -1;     // before it in the list
    int reference = -1;  // the reference that it lies in or is: an index into the list
    int model = -1;      // index into FixtureType::models
    glm::dmat4 parent_from_geometry{1.0};
    std::optional<Beam> beam;
};

struct ChannelSet {
    std::string name;
    std::uint32_t from = 0;  // in the channel's bytes
    std::optional<std::pair<double, double>> physical;
    int slot = 0;  // WheelSlotIndex, from 1; 0: none
};

struct ChannelFunction {
    std::string name, attribute;
    int logical = 0;                                    // which logical channel of its channel
    std::uint32_t from = 0, to = 0, default_value = 0;  // both ends belong to it
    double physical_from = 0.0, physical_to = 1.0;      // to < from is legal
    int wheel = -1, emitter = -1, filter = -1, profile = -1;
    int master = -1;  // the channel whose value decides whether the function is active; -1: none
    std::uint32_t mode_from = 0, mode_to = 0;
    std::vector<ChannelSet> sets;  // by `from`
};

struct Channel {
    std::string name;  // "Geometry_Attribute"
    std::string geometry;
    int bytes = 1;
    int dmx_break = 1;         // from 1; 0: Overwrite
    std::vector<int> offsets;  // from 1, most significant first; empty: virtual, it keeps its default
    int initial = 0;           // function
    std::vector<ChannelFunction> functions;
};

// A channel at one geometry of the tree.
struct PatchedChannel {
    int channel = 0, geometry = 0;
    int dmx_break = 1;
    std::vector<int> slots;  // of the break, from 1, most significant first; empty: virtual
};

struct Mode {
    std::string name, geometry;
    std::vector<Geometry> geometries;  // parents before children
    std::vector<Channel> channels;
    std::vector<PatchedChannel> patched;
    std::map<int, int> footprint;  // of each break: its greatest slot
};

struct Slot {
    std::string name;
    std::optional<Color> color;
    std::string picture;  // entry of the archive; empty: none
};
struct Wheel {
    std::string name;
    std::vector<Slot> slots;
};

struct ProfilePoint {
    double at = 0.0;                // DMXPercentage
    std::array<double, 4> cubic{};  // CFC0 … CFC3
};
struct DmxProfile {
    std::string name;
    std::vector<ProfilePoint> points;  // by `at`
    bool percent = false;              // `at` and the result are 0..100, else 0..1
};

struct NamedColor {
    std::string name;
    std::optional<Color> color;
};

struct FixtureType {
    std::string name, manufacturer, id, data_version;
    std::map<std::string, Color> attribute_colors;  // of the file's own attributes
    std::vector<NamedColor> emitters, filters;
    std::vector<DmxProfile> profiles;
    std::vector<Wheel> wheels;
    std::vector<Model> models;
    std::vector<Mode> modes;
    std::vector<std::string> photometric;  // entries of the archive's photometric files
    exchange::ImportReport report;
};

// xml: description.xml. entries: the names of the archive's files, by which models and pictures are found. What a
// fixture type refers to and does not have is left out, and the report names it. Errors: "bad_gdtf" (not XML, no
// fixture type, no mode whose geometry exists), "too_large".
Result<FixtureType> read_description(std::string_view xml, std::span<const std::string> entries);
// Of a .gdtf that was opened. Errors: also those of its archive.
Result<FixtureType> read_gdtf(const ZipArchive& archive);
// What a .gdtf may unpack to.
inline constexpr ZipLimits kGdtfLimits{
    .archive_bytes = 128u << 20, .entries = 4096, .total_bytes = std::uint64_t{1} << 30, .entry_bytes = 64u << 20};

// Result: the mode of this name, whatever its case; the first where there is none.
struct FoundMode {
    std::size_t index = 0;
    bool as_named = true;
};
FoundMode find_mode(const FixtureType& type, std::string_view name);

// A DMX value as GDTF writes it: "v/n" is mirrored to other numbers of bytes (255/1 is 65535 in two), "v/ns" shifted
// (65280).
struct DmxValue {
    std::uint32_t value = 0;
    int bytes = 1;
    bool shifted = false;
};
std::optional<DmxValue> dmx_value(std::string_view text);
std::uint32_t in_bytes(const DmxValue& value, int bytes);  // 1..4
constexpr std::uint32_t greatest_of(int bytes) {
    return bytes >= 4 ? 0xFFFFFFFFu : (1u << 8 * bytes) - 1;
}

// Result: why a mode without a beam lights nothing, in words of a report. nullptr: it is a luminaire.
// By its attributes or emitters it is one, unless it is a media server, display, laser or hazer. Then the innermost of
// its geometries and axes, of several the first, has got GDTF's default beam.
const char* why_dark(const FixtureType& type, const Mode& mode);

// Result: the colour of a standard attribute ("ColorAdd_R", "ColorSub_C"), as the standard's list has it.
std::optional<Color> standard_color(std::string_view attribute);

}  // namespace gonio::gdtf
