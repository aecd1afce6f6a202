#include "ies/gldf_lights.h"

#include "ies/xml_text.h"

namespace gonio::ies::detail {

using pugi::xml_node;

std::vector<Light> lights_of(const xml_node& variant) {
    std::vector<Light> lights;
    const auto add = [&](Light light) {
        for (Light& other : lights) {
            if (other.emitter != light.emitter || (!other.object.empty() && !light.object.empty())) continue;
            if (other.object.empty()) other.object = light.object;
            if (other.simple.empty()) other.simple = light.simple;
            if (other.model.empty()) other.model = light.model;
            return;
        }
        if (lights.size() < kMaxLights) lights.push_back(light);
    };
    const auto read = [&](const xml_node& parent) {
        for (const xml_node& reference : parent.children()) {
            const std::string_view name = reference.name();
            if (name == "ModelGeometryReference") {
                for (const xml_node& inner : reference.children("EmitterReference"))
                    add({inner,
                         inner.attribute("emitterId").value(),
                         text_of(inner.child("EmitterObjectExternalName")),
                         {},
                         reference.attribute("geometryId").value()});
            } else if (name == "EmitterReference" || name == "SimpleGeometryReference") {
                add({reference,
                     reference.attribute("emitterId").value(),
                     {},
                     reference.attribute("geometryId").value(),
                     {}});
            }
        }
    };
    const xml_node geometry = variant.child("Geometry");
    read(geometry);
    read(geometry.child("GeometryReferences"));
    // Older drafts have the references in the variant itself.
    read(variant);
    read(variant.child("EmitterReferences"));
    return lights;
}

bool is_light(const xml_node& element) {
    const std::string_view name = element.name();
    return name == "FixedLightEmitter" || name == "ChangeableLightEmitter" || name == "MultiChannelLightEmitter";
}

xml_node lone_emitter(const xml_node& root) {
    xml_node lone;
    for (const xml_node& emitter : root.child("GeneralDefinitions").child("Emitters").children("Emitter")) {
        if (!emitter.find_child(is_light)) continue;
        if (lone) return {};
        lone = emitter;
    }
    return lone;
}

}  // namespace gonio::ies::detail
