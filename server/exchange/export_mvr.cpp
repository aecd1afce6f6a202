#include "server/exchange/export_mvr.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <numbers>
#include <set>

#include "ies/core/printed.h"
#include "ies/core/zip.h"
#include "ies/quantities.h"
#include "ies/writers.h"
#include "server/exchange/axes.h"
#include "server/exchange/export_light.h"
#include "server/exchange/export_parts.h"
#include "server/exchange/mvr.h"
#include "server/exchange/xml_write.h"
#include "server/scene/orientation.h"
#include "server/scene/scene.h"

namespace gonio::exchange {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

// world_from_object: of the scene's axes on both sides. Result: MVR's text of it, in mm and Z up.
std::string matrix_text(const glm::dmat4& world_from_object) {
    const glm::dmat4 matrix = z_up_from_y_up() * world_from_object * y_up_from_z_up();
    std::string text;
    for (int c = 0; c < 4; ++c) {
        text += "{";
        for (int r = 0; r < 3; ++r) {
            text += (r > 0 ? "," : "") + entry_text(c == 3 ? 1000.0 * matrix[c][r] : matrix[c][r]);
        }
        text += "}";
    }
    return text;
}

// Where the ray leaves the scene; 3 m on where it stands outside.
glm::dvec3 aimed_point(const Bounds& bounds, const glm::dvec3& from, const glm::dvec3& aim) {
    double leaves = 1e300;
    for (int k = 0; k < 3; ++k) {
        if (!(from[k] > bounds.min[k] && from[k] < bounds.max[k])) return from + 3.0 * aim;
        if (std::abs(aim[k]) > 1e-9)
            leaves = std::min(leaves, ((aim[k] > 0.0 ? bounds.max[k] : bounds.min[k]) - from[k]) / aim[k]);
    }
    return from + std::max(leaves, 0.01) * aim;
}

class ShowWriter {
public:
    explicit ShowWriter(const Scene& scene) : scene_(scene) {
        root_ = add_node(
            document_, "GeneralSceneDescription",
            {{"verMajor", "1"}, {"verMinor", "6"}, {"provider", mvr::kProvider}, {"providerVersion", GONIO_VERSION}});
        user_data_ = add_node(add_node(root_, "UserData"), "Data", {{"provider", mvr::kProvider}, {"ver", "1"}});
        const auto scene_node = add_node(root_, "Scene");
        add_node(scene_node, "AUXData");
        const auto layers = add_node(scene_node, "Layers");
        const auto layer = [&](const char* name) {
            return add_node(
                add_node(layers, "Layer", {{"name", name}, {"uuid", uuid_of(std::string("layer ") + name)}}),
                "ChildList");
        };
        surfaces_ = layer("Surfaces");
        lights_ = layer("Lights");
    }

    std::optional<Error> add_surfaces(const Parts& each) {
        const SceneAsset& asset = *scene_.asset;
        const auto groups = geometry_groups(asset);
        for (const GeometryGroup& group : groups) {
            const std::size_t shown = group.in_world ? group.instances.size() : 1;
            auto glb = export_geometry(asset, std::span(group.instances).first(shown), group.in_world);
            if (!glb) return glb.error();
            const Instance& first = asset.instances[group.instances.front()];
            const std::string file = file_name(gdtf::gdtf_name(first.node), ".glb");
            if (auto error = add_file(file, std::move(*glb))) return error;
            if (group.in_world) {
                add_object(first.node, file, glm::dmat4(1.0));
            } else {
                for (const std::size_t instance : group.instances)
                    add_object(asset.instances[instance].node, file, asset.instances[instance].world_from_mesh);
            }
            if (each) each(files_.size(), groups.size() + scene_.lights.size());
        }
        return std::nullopt;
    }

    std::optional<Error> add(const Light& light) {
        if (light.sun) return std::nullopt;
        const LightPatch patch = patch_of(scene_, light);
        const auto spec = type_of(light, patch);
        if (!spec) return spec.error();
        const std::string uuid = uuid_of("light " + light.name);
        glm::dmat4 place = glm::translate(glm::dmat4(1.0), light.position);
        // A fixture's own axes are Z up: its beam goes along -Z, and C0 is +X.
        if (patch.swings) place = place * glm::mat4_cast(light.world_from_mount);
        if (!patch.swings) place = place * glm::mat4_cast(light.world_from_light) * z_up_from_y_up();
        // A place along the pan axis says nothing of pan: there the angles alone do.
        const bool has_focus = patch.swings && std::abs(std::sin(light.tilt_rad)) > 1e-6;
        const std::string focus = has_focus ? add_focus(light) : std::string();
        const auto node = add_node(lights_, "Fixture", {{"name", light.name}, {"uuid", uuid}});
        add_text(node, "Matrix", matrix_text(place));
        add_text(node, "GDTFSpec", *spec);
        add_text(node, "GDTFMode", gdtf::kWrittenMode);
        if (!focus.empty()) add_text(node, "Focus", focus);
        add_text(node, "CastShadow", "false");
        const std::string number = std::to_string(++fixtures_);
        for (const char* name : {"FixtureID", "FixtureIDNumeric", "UnitNumber"}) add_text(node, name, number);
        if (!patch.breaks.empty()) {
            const auto addresses = add_node(node, "Addresses");
            for (std::size_t i = 0; i < patch.breaks.size(); ++i)
                add_text(addresses, "Address",
                         std::to_string(patch.breaks[i].universe) + "." + std::to_string(patch.breaks[i].address))
                    .append_attribute("break")
                    .set_value(std::to_string(i).c_str());
        }
        if (patch.swings) {
            const auto commands = add_node(node, "CustomCommands");
            const auto turn = [&](const char* attribute, double rad) {
                const double degrees = std::remainder(kDegrees * rad, 360.0);
                add_text(commands, "CustomCommand", gdtf::function_node(attribute) + ",f " + number_text(degrees));
            };
            turn("Pan", light.pan_rad);
            turn("Tilt", light.tilt_rad);
        }
        const LightScale color = color_of(light);
        add_node(user_data_, "Light",
                 {{"uuid", uuid},
                  {"level", number_text(std::min(1.0, shown_level(light, scene_.master_ratio)))},
                  {"multiplier", number_text(color.multiplier)},
                  {"red", number_text(color.color.r)},
                  {"green", number_text(color.color.g)},
                  {"blue", number_text(color.color.b)}});
        return std::nullopt;
    }

    Result<std::string> file() {
        files_.insert(files_.begin(), ZipFile{"GeneralSceneDescription.xml", text_of(document_)});
        auto bytes = write_zip(files_);
        if (bytes && bytes->size() > kMostSavedBytes) return too_large_scene();
        return bytes;
    }

private:
    // Result: a name of the archive that no other one is, not even in other letters.
    std::string file_name(const std::string& base, const std::string& extension) {
        const auto small = [](std::string text) {
            for (char& c : text)
                if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
            return text;
        };
        int& number = numbers_.try_emplace(small(base) + extension, 0).first->second;
        std::string name = base;
        do {
            if (++number > 1) name = base + " " + std::to_string(number);
        } while (!names_.insert(small(name) + extension).second);
        return name + extension;
    }

    std::optional<Error> add_file(std::string name, std::string bytes) {
        bytes_ += bytes.size();
        if (bytes_ > kMostSavedBytes) return too_large_scene();
        files_.push_back({std::move(name), std::move(bytes)});
        return std::nullopt;
    }

    void add_object(const std::string& name, const std::string& file, const glm::dmat4& world_from_object) {
        const auto node = add_node(surfaces_, "SceneObject",
                                   {{"name", name}, {"uuid", uuid_of("surface " + std::to_string(++objects_))}});
        add_text(node, "Matrix", matrix_text(world_from_object));
        add_node(add_node(node, "Geometries"), "Geometry3D", {{"fileName", file}});
    }

    std::string add_focus(const Light& light) {
        const std::string uuid = uuid_of("focus " + light.name);
        const auto node = add_node(lights_, "FocusPoint", {{"name", light.name + " focus"}, {"uuid", uuid}});
        const glm::dvec3 place = aimed_point(scene_.asset->bounds, light.position, aim_of(light.world_from_light));
        add_text(node, "Matrix", matrix_text(glm::translate(glm::dmat4(1.0), place)));
        add_node(node, "Geometries");
        return uuid;
    }

    // Result: the GDTF file of the light, with its web beside it. Lights of one web and one mode share theirs.
    Result<std::string> type_of(const Light& light, const LightPatch& patch) {
        std::string key = ies_key_of(light, light.multiplier) + (patch.swings ? " head" : "");
        gdtf::WrittenType type;
        type.has_head = patch.swings;
        if (patch.swings) type.roll_rad = light.roll_rad;
        key += printed(" %.17g", type.roll_rad);
        type.channels = patch.channels;
        for (const gdtf::WrittenChannel& channel : patch.channels)
            key += printed(" %s %d %d %d %.17g %.17g", channel.attribute.c_str(), channel.dmx_break, channel.slot,
                           channel.bytes, channel.from, channel.to);
        const auto [at, fresh] = types_.try_emplace(key);
        if (!fresh) return at->second;
        const ies::Photometry photometry = photometry_of(light, light.multiplier);
        auto web = ies_file_of(light, light.multiplier);
        if (!web) return web.error();
        at->second = file_name("Gonio@" + gdtf::gdtf_name(light.profile->name), ".gdtf");
        const std::string stem = at->second.substr(0, at->second.size() - 5);
        type.name = stem.substr(6);
        type.id = uuid_of(stem + *web + write_description(type));
        type.flux_lm = std::min(1e9, ies::total_flux(photometry.web).in(lm));
        const ies::PlaneBeams beams = ies::plane_beams(photometry.web, Angle::radians(0.0));
        const auto angle = [](const std::optional<Angle>& full) {
            return std::clamp(full ? kDegrees * full->radians() : 180.0, 0.01, 180.0);
        };
        type.beam_angle_deg = angle(beams.beam.outermost);
        type.field_angle_deg = std::max(type.beam_angle_deg, angle(beams.field.outermost));
        type.radius_m =
            std::min(100.0, 0.5 * std::min(photometry.opening.width.in(m), photometry.opening.length.in(m)));
        type.power_w = std::clamp(photometry.provenance.input_watts, 0.0, 1e9);
        const auto gdtf = write_zip(std::vector<ZipFile>{{"description.xml", write_description(type)}});
        if (!gdtf) return gdtf.error();
        if (auto error = add_file(at->second, *gdtf)) return *error;
        if (auto error = add_file(stem + ".ies", std::move(*web))) return *error;
        return at->second;
    }

    const Scene& scene_;
    pugi::xml_document document_;
    pugi::xml_node root_, user_data_, surfaces_, lights_;
    std::vector<ZipFile> files_;
    std::size_t bytes_ = 0, objects_ = 0, fixtures_ = 0;
    std::set<std::string> names_{"generalscenedescription.xml"};
    std::map<std::string, int> numbers_;
    std::map<std::string, std::string> types_;  // by what they are made of: the file
};

}  // namespace

std::string uuid_of(std::string_view text) {
    // FNV-1a, twice from different starts.
    const auto hash = [&](std::uint64_t value) {
        for (const char c : text) value = (value ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
        return value;
    };
    const std::uint64_t high = (hash(0xcbf29ce484222325u) & ~std::uint64_t{0xF000}) | 0x8000u;
    const std::uint64_t low = (hash(0x9ae16a3b2f90404fu) & ~(std::uint64_t{3} << 62)) | (std::uint64_t{2} << 62);
    return printed("%08X-%04X-%04X-%04X-%012llX", static_cast<unsigned>(high >> 32),
                   static_cast<unsigned>(high >> 16 & 0xFFFF), static_cast<unsigned>(high & 0xFFFF),
                   static_cast<unsigned>(low >> 48), static_cast<unsigned long long>(low & 0xFFFFFFFFFFFF));
}

Result<std::string> export_mvr(const Scene& scene, const Parts& each) {
    ShowWriter show(scene);
    if (auto error = show.add_surfaces(each)) return *error;
    for (const Light& light : scene.lights)
        if (auto error = show.add(light)) return *error;
    return show.file();
}

}  // namespace gonio::exchange
