// Samples of exchange formats, and small documents of their kind. For tests.
#pragma once

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

namespace gonio::test {

inline std::string bytes_of(const std::filesystem::path& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

// A fixture type with these elements; what is empty is left out.
struct GdtfText {
    std::string geometries, modes, wheels, physics, models, attributes;
};
inline std::string gdtf_text(const GdtfText& text) {
    return "<GDTF DataVersion=\"1.2\"><FixtureType Name=\"Type\" Manufacturer=\"Maker\" FixtureTypeID=\"id\">"
           "<AttributeDefinitions><Attributes>" +
           text.attributes + "</Attributes></AttributeDefinitions><Wheels>" + text.wheels +
           "</Wheels><PhysicalDescriptions>" + text.physics + "</PhysicalDescriptions><Models>" + text.models +
           "</Models><Geometries>" + text.geometries + "</Geometries><DMXModes>" + text.modes +
           "</DMXModes></FixtureType></GDTF>";
}

// A channel with one function over its whole range.
inline std::string channel_text(const std::string& geometry, const std::string& attribute, const std::string& offset,
                                const std::string& from = "0", const std::string& to = "1",
                                const std::string& more = "", const std::string& dmx_break = "1") {
    return "<DMXChannel DMXBreak=\"" + dmx_break + "\" Offset=\"" + offset + "\" Geometry=\"" + geometry +
           "\"><LogicalChannel Attribute=\"" + attribute + "\"><ChannelFunction Attribute=\"" + attribute +
           "\" DMXFrom=\"0/1\" Default=\"0/1\" PhysicalFrom=\"" + from + "\" PhysicalTo=\"" + to + "\" " + more +
           "/></LogicalChannel></DMXChannel>";
}

inline std::string mode_text(const std::string& geometry, const std::string& channels) {
    return "<DMXMode Name=\"Mode\" Geometry=\"" + geometry + "\"><DMXChannels>" + channels + "</DMXChannels></DMXMode>";
}

}  // namespace gonio::test
