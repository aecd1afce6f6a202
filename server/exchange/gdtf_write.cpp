#include "server/exchange/gdtf_write.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "server/exchange/xml_write.h"

namespace gonio::gdtf {
namespace {

using exchange::add_node;
using exchange::entry_text;
using exchange::number_text;

// What a mode can have. Emitters have the primaries of Rec.709, so that their sum is its white: 100 %.
struct AttributeRow {
    const char *name, *pretty, *geometry, *feature, *activation, *unit;
    const char *emitter, *color, *wavelength_nm;
};
constexpr AttributeRow kAttributes[] = {
    {"Dimmer", "Dim", "Body", "Dimmer.Dimmer", "", "LuminousIntensity", "", "", ""},
    {"Pan", "P", "Yoke", "Position.PanTilt", "PanTilt", "Angle", "", "", ""},
    {"Tilt", "T", "Head", "Position.PanTilt", "PanTilt", "Angle", "", "", ""},
    {"ColorAdd_R", "R", "Body", "Color.RGB", "ColorRGB", "ColorComponent", "Red", "0.64,0.33,21.26", "611"},
    {"ColorAdd_G", "G", "Body", "Color.RGB", "ColorRGB", "ColorComponent", "Green", "0.3,0.6,71.52", "549"},
    {"ColorAdd_B", "B", "Body", "Color.RGB", "ColorRGB", "ColorComponent", "Blue", "0.15,0.06,7.22", "464"},
};

const AttributeRow& row_of(const std::string& attribute) {
    for (const AttributeRow& row : kAttributes)
        if (attribute == row.name) return row;
    return kAttributes[0];
}

constexpr const char* kIdentity = "{1,0,0,0}{0,1,0,0}{0,0,1,0}{0,0,0,1}";

// Rows are the images of the axes; the translation is the fourth column.
std::string turn_about_z(double rad) {
    if (rad == 0.0) return kIdentity;
    const std::string c = entry_text(std::cos(rad)), s = entry_text(std::sin(rad)), minus = entry_text(-std::sin(rad));
    return "{" + c + "," + s + ",0,0}{" + minus + "," + c + ",0,0}{0,0,1,0}{0,0,0,1}";
}

void add_attributes(pugi::xml_node type) {
    const auto definitions = add_node(type, "AttributeDefinitions");
    const auto activations = add_node(definitions, "ActivationGroups");
    for (const char* name : {"PanTilt", "ColorRGB"}) add_node(activations, "ActivationGroup", {{"Name", name}});
    const auto groups = add_node(definitions, "FeatureGroups");
    for (const auto& [group, feature] : {std::pair("Dimmer", "Dimmer"), {"Position", "PanTilt"}, {"Color", "RGB"}})
        add_node(add_node(groups, "FeatureGroup", {{"Name", group}, {"Pretty", group}}), "Feature",
                 {{"Name", feature}});
    const auto attributes = add_node(definitions, "Attributes");
    for (const AttributeRow& row : kAttributes) {
        auto node = add_node(attributes, "Attribute", {{"Name", row.name}, {"Pretty", row.pretty}});
        if (*row.activation) node.append_attribute("ActivationGroup").set_value(row.activation);
        node.append_attribute("Feature").set_value(row.feature);
        node.append_attribute("PhysicalUnit").set_value(row.unit);
        if (*row.color) node.append_attribute("Color").set_value(row.color);
    }
}

void add_geometries(pugi::xml_node type, const WrittenType& from) {
    const auto models = add_node(type, "Models");
    const auto model = [&](const char* name, const char* shape, const char* length, const char* width,
                           const char* height) {
        add_node(models, "Model",
                 {{"Name", name}, {"Length", length}, {"Width", width}, {"Height", height}, {"PrimitiveType", shape}});
    };
    model("Body", "Cube", "0.2", "0.2", "0.05");
    if (from.has_head) {
        model("Yoke", "Yoke", "0.25", "0.1", "0.25");
        model("Head", "Head", "0.2", "0.2", "0.25");
    }
    model("Lens", "Cylinder", "0.1", "0.1", "0.01");
    auto inner = add_node(add_node(type, "Geometries"), "Geometry",
                          {{"Name", "Body"}, {"Model", "Body"}, {"Position", kIdentity}});
    if (from.has_head)
        for (const char* axis : {"Yoke", "Head"})
            inner = add_node(inner, "Axis", {{"Name", axis}, {"Model", axis}, {"Position", kIdentity}});
    add_node(inner, "Beam",
             {{"Name", "Lens"},
              {"Model", "Lens"},
              {"Position", turn_about_z(from.roll_rad)},
              {"LampType", "LED"},
              {"PowerConsumption", number_text(from.power_w)},
              {"LuminousFlux", number_text(from.flux_lm)},
              {"ColorTemperature", "6504"},
              {"BeamAngle", number_text(from.beam_angle_deg)},
              {"FieldAngle", number_text(from.field_angle_deg)},
              {"ThrowRatio", "1"},
              {"RectangleRatio", "1.7777"},
              {"BeamRadius", number_text(from.radius_m)},
              {"BeamType", "Wash"},
              {"ColorRenderingIndex", "100"}});
}

// Result: the DMX value that is nearest to a physical one, as "v/n".
std::string dmx_of(const WrittenChannel& channel) {
    const double most = std::pow(256.0, channel.bytes) - 1.0;
    const double share =
        channel.to != channel.from ? (channel.value - channel.from) / (channel.to - channel.from) : 0.0;
    return number_text(std::round(std::clamp(share, 0.0, 1.0) * most)) + "/" + std::to_string(channel.bytes);
}

void add_mode(pugi::xml_node type, const WrittenType& from) {
    const auto mode = add_node(add_node(type, "DMXModes"), "DMXMode", {{"Name", kWrittenMode}, {"Geometry", "Body"}});
    const auto channels = add_node(mode, "DMXChannels");
    for (const WrittenChannel& channel : from.channels) {
        const AttributeRow& row = row_of(channel.attribute);
        std::string offset = channel.slot > 0 ? std::to_string(channel.slot) : "None";
        if (channel.slot > 0)
            for (int i = 1; i < channel.bytes; ++i) offset += "," + std::to_string(channel.slot + i);
        const auto node = add_node(channels, "DMXChannel",
                                   {{"DMXBreak", std::to_string(channel.dmx_break)},
                                    {"Offset", offset},
                                    {"InitialFunction", function_node(channel.attribute)},
                                    {"Highlight", "None"},
                                    {"Geometry", row.geometry}});
        const auto logical = add_node(node, "LogicalChannel",
                                      {{"Attribute", channel.attribute},
                                       {"Snap", "No"},
                                       {"Master", channel.attribute == "Dimmer" ? "Grand" : "None"},
                                       {"MibFade", "0"},
                                       {"DMXChangeTimeLimit", "0"}});
        auto function = add_node(logical, "ChannelFunction",
                                 {{"Name", channel.attribute + " 1"},
                                  {"Attribute", channel.attribute},
                                  {"OriginalAttribute", ""},
                                  {"DMXFrom", "0/" + std::to_string(channel.bytes)},
                                  {"Default", dmx_of(channel)},
                                  {"PhysicalFrom", number_text(channel.from)},
                                  {"PhysicalTo", number_text(channel.to)},
                                  {"RealFade", "0"},
                                  {"RealAcceleration", "0"}});
        if (*row.emitter) function.append_attribute("Emitter").set_value(row.emitter);
    }
    add_node(mode, "Relations");
    add_node(mode, "FTMacros");
}

}  // namespace

std::string gdtf_name(const std::string& text) {
    std::string name;
    for (const char c : text) {
        const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
        name += letter || c == ' ' || c == '-' || c == '_' ? c : '_';
    }
    name.resize(std::min<std::size_t>(name.size(), 64));
    const std::size_t begin = name.find_first_not_of(' '), end = name.find_last_not_of(' ');
    return begin == std::string::npos ? "fixture" : name.substr(begin, end - begin + 1);
}

std::string function_node(const std::string& attribute) {
    return std::string(row_of(attribute).geometry) + "_" + attribute + "." + attribute + "." + attribute + " 1";
}

std::string write_description(const WrittenType& from) {
    pugi::xml_document document;
    const auto type = add_node(add_node(document, "GDTF", {{"DataVersion", "1.2"}}), "FixtureType",
                               {{"Name", from.name},
                                {"ShortName", from.name},
                                {"LongName", from.name},
                                {"Manufacturer", "Gonio"},
                                {"Description", "A luminaire by its measured web, which is beside this file as LM-63"},
                                {"FixtureTypeID", from.id},
                                {"Thumbnail", ""},
                                {"RefFT", ""},
                                {"CanHaveChildren", "No"}});
    add_attributes(type);
    add_node(type, "Wheels");
    const auto emitters = add_node(add_node(type, "PhysicalDescriptions"), "Emitters");
    for (const AttributeRow& row : kAttributes)
        if (*row.emitter)
            add_node(emitters, "Emitter",
                     {{"Name", row.emitter}, {"Color", row.color}, {"DominantWaveLength", row.wavelength_nm}});
    add_geometries(type, from);
    add_mode(type, from);
    for (const char* rest : {"Revisions", "FTPresets", "Protocols"}) add_node(type, rest);
    return exchange::text_of(document);
}

}  // namespace gonio::gdtf
