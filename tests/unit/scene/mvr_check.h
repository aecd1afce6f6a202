// What an .mvr must be like, by the standard (DIN SPEC 15801, 1.6) and by what readers stumble over. It has a reading
// of its own: nothing of server/exchange is in it.
#pragma once

#include <charconv>
#include <cmath>
#include <cstring>
#include <map>
#include <pugixml.hpp>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "ies/core/zip.h"

namespace gonio::test {

class MvrCheck {
public:
    // Result: a sentence for each fault.
    static std::vector<std::string> faults(const std::string& bytes) {
        MvrCheck check;
        check.archive(bytes);
        return check.faults_;
    }

private:
    void require(bool holds, const std::string& fault) {
        if (!holds) faults_.push_back(fault);
    }

    // The central directory as it stands (APPNOTE 4.3.12): names, flags and methods.
    void directory(const std::string& bytes) {
        std::set<std::string> small;
        const auto number = [&](std::size_t at, unsigned size) {
            unsigned value = 0;
            for (unsigned i = 0; i < size; ++i) value |= static_cast<unsigned char>(bytes[at + i]) << 8 * i;
            return value;
        };
        const std::size_t end = bytes.rfind("PK\x05\x06");
        if (end == std::string::npos) return require(false, "no zip archive");
        std::size_t at = number(end + 16, 4);
        for (unsigned i = 0; i < number(end + 10, 2); ++i) {
            std::string name = bytes.substr(at + 46, number(at + 28, 2));
            require((number(at + 8, 2) & 1) == 0, "encrypted: " + name);
            require(number(at + 10, 2) == 0 || number(at + 10, 2) == 8, "neither stored nor deflated: " + name);
            require(name.find_first_of("/\\") == std::string::npos, "in a folder: " + name);
            for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
            require(small.insert(name).second, "a name twice: " + name);
            at += 46 + number(at + 28, 2) + number(at + 30, 2) + number(at + 32, 2);
        }
    }

    void archive(const std::string& bytes) {
        directory(bytes);
        if (!faults_.empty()) return;
        auto opened = open_zip(bytes);
        if (!opened) return require(false, "it does not open: " + opened.error().code);
        for (const ZipEntry& entry : opened->entries()) {
            const auto content = opened->read(entry.name);
            require(static_cast<bool>(content), "it does not unpack: " + entry.name);
            if (content) files_[entry.name] = *content;
        }
        const auto found = files_.find("GeneralSceneDescription.xml");
        if (found == files_.end()) return require(false, "no GeneralSceneDescription.xml");
        pugi::xml_document document;
        require(static_cast<bool>(document.load_string(found->second.c_str())), "no XML");
        description(document.child("GeneralSceneDescription"));
    }

    std::string uuid_of(const pugi::xml_node& node) {
        static const std::regex canonical("[0-9A-F]{8}-[0-9A-F]{4}-[0-9A-F]{4}-[0-9A-F]{4}-[0-9A-F]{12}");
        const std::string uuid = node.attribute("uuid").value();
        require(std::regex_match(uuid, canonical), std::string("no canonical UUID: ") + node.name() + " " + uuid);
        require(uuids_.insert(uuid).second, "a UUID twice: " + uuid);
        return uuid;
    }

    void description(const pugi::xml_node& root) {
        require(std::strcmp(root.attribute("verMajor").value(), "1") == 0, "verMajor");
        require(std::strcmp(root.attribute("verMinor").value(), "6") == 0, "verMinor");
        for (const char* needed : {"provider", "providerVersion"})
            require(*root.attribute(needed).value() != '\0', needed);
        require(in_order(root, {"UserData", "Scene"}), "children of GeneralSceneDescription");
        const pugi::xml_node scene = root.child("Scene"), layers = scene.child("Layers");
        require(in_order(scene, {"AUXData", "Layers"}) && layers, "children of Scene");
        for (const pugi::xml_node node : scene.child("AUXData").children()) uuid_of(node);
        require(static_cast<bool>(layers.child("Layer")), "no Layer");
        for (const pugi::xml_node layer : layers.children()) {
            require(std::strcmp(layer.name(), "Layer") == 0, "a child of Layers that is no Layer");
            uuid_of(layer);
            require(static_cast<bool>(layer.child("ChildList")), "a Layer without ChildList");
            for (const pugi::xml_node node : layer.child("ChildList").children()) objects_.push_back(node);
        }
        for (std::size_t i = 0; i < objects_.size(); ++i) {
            const pugi::xml_node node = objects_[i];
            const std::string uuid = uuid_of(node);
            if (std::strcmp(node.name(), "FocusPoint") == 0) focus_.insert(uuid);
            for (const pugi::xml_node child : node.child("ChildList").children()) objects_.push_back(child);
        }
        for (const pugi::xml_node& node : objects_) object(node);
    }

    static bool in_order(const pugi::xml_node& node, const std::vector<std::string>& names) {
        std::size_t at = 0;
        for (const pugi::xml_node child : node.children()) {
            while (at < names.size() && names[at] != child.name()) ++at;
            if (at++ == names.size()) return false;
        }
        return true;
    }

    void matrix(const pugi::xml_node& node) {
        static const std::regex form(R"(\{([^{}]*)\}\{([^{}]*)\}\{([^{}]*)\}\{([^{}]*)\})"), decimals("[{}0-9.,-]*");
        const std::string text = node.child_value("Matrix");
        std::smatch parts;
        if (!std::regex_match(text, parts, form)) return require(false, "no 4x3 matrix: " + text);
        require(std::regex_match(text, decimals), "an exponent: " + text);
        double m[4][3] = {};
        for (std::size_t r = 0; r < 4; ++r) {
            const std::string row = parts[r + 1];
            const char* at = row.data();
            for (std::size_t c = 0; c < 3; ++c) {
                const auto read = std::from_chars(at, row.data() + row.size(), m[r][c]);
                require(read.ec == std::errc() && std::isfinite(m[r][c]), "no number: " + text);
                at = read.ptr + (read.ptr < row.data() + row.size() && *read.ptr == ',' ? 1 : 0);
            }
            require(at == row.data() + row.size(), "more than three numbers: " + text);
        }
        const double volume = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                              m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                              m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
        require(std::abs(volume) > 1e-12, "a matrix without volume: " + text);
    }

    void object(const pugi::xml_node& node) {
        const std::string kind = node.name(), name = kind + " " + node.attribute("name").value();
        static const std::set<std::string> known{"SceneObject", "GroupObject", "FocusPoint",  "Fixture",
                                                 "Support",     "Truss",       "VideoScreen", "Projector"};
        require(known.contains(kind), "no object: " + kind);
        if (node.child("Matrix")) matrix(node);
        if (kind == "Fixture") return fixture(node, name);
        require(kind == "GroupObject" || node.child("Geometries"), "no Geometries: " + name);
        for (const pugi::xml_node part : node.child("Geometries").children()) {
            require(std::strcmp(part.name(), "Geometry3D") == 0, "a Symbol needs its Symdef: " + name);
            const std::string file = part.attribute("fileName").value();
            require(file.ends_with(".glb") || file.ends_with(".3ds"), "no model: " + file);
            require(files_.contains(file), "a model is missing: " + file);
            require(!file.ends_with(".glb") || files_[file].starts_with("glTF"), "no glTF: " + file);
        }
    }

    void fixture(const pugi::xml_node& node, const std::string& name) {
        require(in_order(node, {"Matrix",     "Classing",         "GDTFSpec",       "GDTFMode",      "Focus",
                                "CastShadow", "DMXInvertPan",     "DMXInvertTilt",  "Position",      "Function",
                                "FixtureID",  "FixtureIDNumeric", "UnitNumber",     "ChildPosition", "Addresses",
                                "Protocols",  "Alignments",       "CustomCommands", "Overwrites",    "Connections",
                                "Color",      "CustomIdType",     "CustomId",       "Mappings",      "Gobo",
                                "ChildList"}),
                "children of " + name);
        for (const char* needed : {"GDTFSpec", "GDTFMode", "FixtureID", "FixtureIDNumeric", "UnitNumber"})
            require(*node.child_value(needed) != '\0', std::string(needed) + " of " + name);
        const std::string focus = node.child_value("Focus");
        require(focus.empty() || focus_.contains(focus), "no such focus point: " + name);
        const std::string spec = node.child_value("GDTFSpec");
        require(spec.ends_with(".gdtf"), "a GDTFSpec without .gdtf: " + spec);
        if (!files_.contains(spec)) return require(false, "a GDTF is missing: " + spec);
        require(files_.contains(spec.substr(0, spec.size() - 5) + ".ies"), "no photometry beside " + spec);
        const auto footprint = type(spec, node.child_value("GDTFMode"));
        std::set<int> breaks;
        for (const pugi::xml_node address : node.child("Addresses").children()) {
            const int at = address.attribute("break").as_int(-1);
            require(breaks.insert(at).second, "a break twice: " + name);
            int universe = 0, slot = 0;
            const bool written = std::sscanf(address.child_value(), "%d.%d", &universe, &slot) == 2;
            require(written && universe >= 1 && slot >= 1, std::string("no address: ") + address.child_value());
            const auto needs = footprint.find(at + 1);  // breaks count from 0 here, from 1 in GDTF
            require(needs != footprint.end(), "a break without channels: " + name);
            if (needs != footprint.end())
                require(slot + needs->second - 1 <= 512, "a footprint beyond its universe: " + name);
        }
    }

    // Result: the greatest slot of each break of the mode. Each type is checked once.
    std::map<int, int> type(const std::string& spec, const std::string& mode_name) {
        std::map<int, int> footprint;
        auto opened = open_zip(files_[spec]);
        if (!opened) return require(false, "no GDTF: " + spec), footprint;
        const auto text = opened->read("description.xml");
        pugi::xml_document document;
        if (!text || !document.load_string(text->c_str())) return require(false, "no description: " + spec), footprint;
        const pugi::xml_node root = document.child("GDTF"), own = root.child("FixtureType");
        const auto fault = [&](bool holds, const std::string& what) { require(holds, spec + ": " + what); };
        if (checked_.insert(spec).second) {
            fault(std::strcmp(root.attribute("DataVersion").value(), "1.2") == 0, "DataVersion");
            for (const char* needed : {"Name", "Manufacturer", "Description", "FixtureTypeID"})
                fault(*own.attribute(needed).value() != '\0', needed);
            static const std::regex allowed("[A-Za-z0-9 _-]+");
            fault(std::regex_match(own.attribute("Name").value(), allowed), "characters of its name");
            static const std::regex canonical("[0-9A-F]{8}(-[0-9A-F]{4}){3}-[0-9A-F]{12}");
            fault(std::regex_match(own.attribute("FixtureTypeID").value(), canonical), "FixtureTypeID");
            fault(types_.insert(own.attribute("FixtureTypeID").value()).second, "FixtureTypeID of another type");
            fault(in_order(own, {"AttributeDefinitions", "Wheels", "PhysicalDescriptions", "Models", "Geometries",
                                 "DMXModes", "Revisions", "FTPresets", "Protocols"}),
                  "children of FixtureType");
        }
        std::set<std::string> attributes, features, models, emitters, geometries;
        for (const auto& group : own.select_nodes("AttributeDefinitions/FeatureGroups/FeatureGroup"))
            for (const pugi::xml_node feature : group.node().children("Feature"))
                features.insert(std::string(group.node().attribute("Name").value()) + "." +
                                feature.attribute("Name").value());
        for (const auto& one : own.select_nodes("AttributeDefinitions/Attributes/Attribute")) {
            attributes.insert(one.node().attribute("Name").value());
            fault(features.contains(one.node().attribute("Feature").value()), "an attribute's feature");
        }
        for (const auto& one : own.select_nodes("Models/Model")) models.insert(one.node().attribute("Name").value());
        for (const auto& one : own.select_nodes("PhysicalDescriptions/Emitters/Emitter"))
            emitters.insert(one.node().attribute("Name").value());
        for (const auto& one : own.select_nodes("Geometries//*")) {
            fault(geometries.insert(one.node().attribute("Name").value()).second, "a geometry's name twice");
            fault(models.contains(one.node().attribute("Model").value()), "a geometry's model");
        }
        // matrixtype and dmxtype of the standard's XML schema.
        static const std::regex matrix(R"((\{-?[0-9]+\.?[0-9]*(,-?[0-9]+\.?[0-9]*){3}\}){4})"),
            dmx("[0-9]+/[1-9][0-9]*s?");
        for (const auto& one : own.select_nodes("Geometries//@Position"))
            fault(std::regex_match(one.attribute().value(), matrix), one.attribute().value());
        for (const auto& one : own.select_nodes("DMXModes//@DMXFrom | DMXModes//@Default"))
            fault(std::regex_match(one.attribute().value(), dmx), one.attribute().value());
        const auto beams = own.select_nodes("Geometries//Beam");
        fault(beams.size() == 1, "one beam");
        for (const auto& beam : beams) {
            fault(beam.node().attribute("LuminousFlux").as_double(-1) >= 0.0, "flux");
            const double inner = beam.node().attribute("BeamAngle").as_double(),
                         outer = beam.node().attribute("FieldAngle").as_double();
            fault(inner > 0.0 && inner <= outer && outer <= 180.0, "angles");
        }
        const pugi::xml_node mode = own.child("DMXModes").find_child_by_attribute("DMXMode", "Name", mode_name.c_str());
        fault(static_cast<bool>(mode), "no mode " + mode_name);
        fault(static_cast<bool>(
                  own.child("Geometries").find_child_by_attribute("Name", mode.attribute("Geometry").value())),
              "the mode's geometry is not at the top");
        std::set<std::pair<int, int>> slots;
        for (const pugi::xml_node channel : mode.child("DMXChannels").children()) {
            const std::string geometry = channel.attribute("Geometry").value(),
                              attribute = channel.child("LogicalChannel").attribute("Attribute").value();
            fault(geometries.contains(geometry), "a channel's geometry");
            for (const pugi::xml_node function : channel.child("LogicalChannel").children()) {
                fault(attributes.contains(function.attribute("Attribute").value()), "a function's attribute");
                const std::string emitter = function.attribute("Emitter").value();
                fault(emitter.empty() || emitters.contains(emitter), "a function's emitter");
                fault(channel.attribute("InitialFunction").value() ==
                          geometry + "_" + attribute + "." + attribute + "." + function.attribute("Name").value(),
                      "InitialFunction");
            }
            const int at = channel.attribute("DMXBreak").as_int();
            const std::string offset = channel.attribute("Offset").value();
            int coarse = 0, fine = 0;
            const int count = offset == "None" ? 0 : std::sscanf(offset.c_str(), "%d,%d", &coarse, &fine);
            fault(offset == "None" || count >= 1, "an offset");
            for (const int slot : {coarse, fine})
                if (slot > 0) {
                    fault(slots.emplace(at, slot).second, "two channels share a slot");
                    footprint[at] = std::max(footprint[at], slot);
                }
        }
        return footprint;
    }

    std::vector<std::string> faults_;
    std::map<std::string, std::string> files_;
    std::vector<pugi::xml_node> objects_;
    std::set<std::string> uuids_, focus_, checked_, types_;
};

}  // namespace gonio::test
