// The parts of the GDTF reader: each turns one kind of element into values. Only for .cpp files, because it brings
// pugixml.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "server/exchange/gdtf.h"
#include "server/exchange/xml_read.h"

namespace gonio::gdtf {

// A break of a geometry reference.
struct ReferenceBreak {
    int dmx_break = 1, offset = 1;
};

// What one reading has gathered so far.
struct GdtfRead {
    FixtureType& type;
    pugi::xml_node root;                                               // FixtureType
    std::map<std::string_view, pugi::xml_node> top_level{};            // geometries by name, the first of each
    std::map<pugi::xml_node, std::vector<ReferenceBreak>> breaks{};    // of each reference, in the file's order
    std::map<pugi::xml_node, std::vector<pugi::xml_node>> children{};  // of each geometry, those that are geometries
    std::map<std::string, std::string> photometric{};         // entries by their names in lower case, the first of each
    std::size_t geometries = 0, channels = 0, functions = 0;  // of the bounds

    void note(exchange::Outcome outcome, const char* what, std::string_view name) {
        type.report.add(outcome, what, name);
    }
    // Result: the attribute's number; nothing where it is missing, or where it is none: that is noted with `name`, of
    // the element.
    std::optional<double> number(const pugi::xml_node& node, const char* attribute, std::string_view name);
    std::optional<long long> whole_number(const pugi::xml_node& node, const char* attribute, std::string_view name);
};

// The tree of a mode's geometry, with the breaks of each reference by its index. They are GdtfRead's.
using ReferenceBreaks = std::map<int, std::span<const ReferenceBreak>>;
std::optional<Error> read_tree(GdtfRead& read, Mode& mode, ReferenceBreaks& breaks);
Beam read_beam(GdtfRead& read, const pugi::xml_node& node);
std::optional<Error> read_channels(GdtfRead& read, const pugi::xml_node& node, Mode& mode,
                                   const ReferenceBreaks& breaks);

// Gives a mode that has no beam the one that why_dark() says.
void guess_beam(const FixtureType& type, Mode& mode);

// Fills the table of top-level geometries.
void find_top_level(GdtfRead& read);
// Fills the table of photometric entries, once the type has them.
void find_photometric(GdtfRead& read);

// Result: of "x,y,Y"; nothing where it is anything else, or no colour.
std::optional<Color> color_of(std::string_view text);
// Result: that of the attribute `Color`; a text that is none is noted.
std::optional<Color> noted_color(GdtfRead& read, const pugi::xml_node& node, const std::string& name);
// Reads the emitters: the colour of each is that of its measured spectrum, else its own, else that of its wavelength on
// the locus. Its luminance is its own, else its attribute's; where all emitters have measured intensities, those.
void read_emitters(GdtfRead& read, const pugi::xml_node& list);
using exchange::written;
// Result: the index of the item of this name; -1 where there is none. Empty and "None" name nothing.
template <typename Items>
int index_of(const Items& items, std::string_view name) {
    if (name.empty() || name == "None") return -1;
    for (std::size_t i = 0; i < items.size(); ++i)
        if (items[i].name == name) return static_cast<int>(i);
    return -1;
}

}  // namespace gonio::gdtf
