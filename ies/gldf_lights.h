// Which emitters a variant of a GLDF product names. Only for .cpp files, because it brings pugixml.
#pragma once

#include <pugixml.hpp>
#include <string_view>
#include <vector>

namespace gonio::ies::detail {

inline constexpr std::size_t kMaxLights = 1000;  // of a variant; the rest is ignored

// A light of a variant: an emitter, and where in the luminaire's geometry it sits.
struct Light {
    pugi::xml_node reference;
    std::string_view emitter;        // id
    std::string_view object;         // EmitterObjectExternalName
    std::string_view simple, model;  // ids of geometries
};

// Result: those of the variant's Geometry and, as older drafts have it, of the variant itself.
std::vector<Light> lights_of(const pugi::xml_node& variant);
// Whether the element is a FixedLightEmitter, ChangeableLightEmitter or MultiChannelLightEmitter.
bool is_light(const pugi::xml_node& element);
// Result: the product's Emitter, where it has only one with light: that of variants that name none, of older drafts.
pugi::xml_node lone_emitter(const pugi::xml_node& root);

}  // namespace gonio::ies::detail
