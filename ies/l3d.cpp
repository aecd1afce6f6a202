#include "ies/l3d.h"

#include <cmath>
#include <pugixml.hpp>

#include "ies/core/zip.h"
#include "ies/text_scan.h"
#include "ies/xml_text.h"

namespace gonio::ies::detail {

namespace {

using pugi::xml_node;

constexpr int kMostAncestors = 64;

ZipLimits limits() {
    ZipLimits result;
    result.archive_bytes = result.entry_bytes = kMaxFileBytes;
    result.total_bytes = 4 * kMaxFileBytes;
    return result;
}

struct Objects : pugi::xml_tree_walker {
    std::vector<xml_node> found;
    bool for_each(xml_node& node) override {
        if (node.name() == std::string_view("LightEmittingObject")) found.push_back(node);
        return found.size() < kMaxL3dObjects;
    }
};

// Sums the turns of the object and of what holds it. Result: whether they are about the vertical, by right angles.
Result<bool> turn_of(std::string_view text, const xml_node& object, double& z_deg) {
    bool upright = true;
    int levels = 0;
    for (xml_node node = object; node && levels < kMostAncestors; node = node.parent(), ++levels) {
        const xml_node rotation = node.child("Rotation");
        for (const char* axis : {"x", "y", "z"}) {
            double degrees = 0.0;
            if (!rotation.attribute(axis)) continue;
            if (auto error = read_number(text, rotation, rotation.attribute(axis).value(), axis, degrees))
                return *error;
            if (*axis == 'z') {
                z_deg += degrees;
            } else {
                upright = upright && std::remainder(degrees, 360.0) == 0.0;
            }
        }
    }
    return upright && std::abs(std::remainder(z_deg, 90.0)) < 1e-3;
}

Result<L3dObject> read_object(std::string_view text, const xml_node& node) {
    L3dObject object;
    object.name = node.attribute("partName").value();
    double x = 0.0;
    double y = 0.0;
    if (const xml_node rectangle = node.child("Rectangle")) {
        object.opening.shape = OpeningShape::rectangle;
        if (auto error = read_number(text, rectangle, rectangle.attribute("sizeX").value(), "sizeX", x)) return *error;
        if (auto error = read_number(text, rectangle, rectangle.attribute("sizeY").value(), "sizeY", y)) return *error;
    } else if (const xml_node circle = node.child("Circle")) {
        object.opening.shape = OpeningShape::ellipse;
        if (auto error = read_number(text, circle, circle.attribute("diameter").value(), "diameter", x)) return *error;
        y = x;
    }
    double z_deg = 0.0;
    const auto upright = turn_of(text, node, z_deg);
    if (!upright) return upright.error();
    object.turned = !*upright;
    const bool crossed = *upright && std::abs(std::remainder(z_deg, 180.0)) > 45.0;
    object.opening.width = std::abs(crossed ? y : x) * m;
    object.opening.length = std::abs(crossed ? x : y) * m;
    return object;
}

}  // namespace

Result<std::vector<L3dObject>> read_l3d(std::string bytes) {
    const auto archive = open_zip(std::move(bytes), limits());
    if (!archive) return archive.error();
    const auto structure = archive->read("structure.xml");
    if (!structure) return structure.error();
    const std::string text = xml_as_utf8(*structure);
    pugi::xml_document xml;
    if (auto error = parse_xml(text, xml)) return *error;
    if (xml.document_element().name() != std::string_view("Luminaire"))
        return error_at(text, offset_of(xml.document_element()), "unknown_root", xml.document_element().name(),
                        "the root element of structure.xml is not Luminaire");
    Objects objects;
    xml.traverse(objects);
    std::vector<L3dObject> result;
    for (const xml_node& node : objects.found) {
        auto object = read_object(text, node);
        if (!object) return object.error();
        result.push_back(std::move(*object));
    }
    return result;
}

}  // namespace gonio::ies::detail
