#include "server/scene/merge_parts.h"

#include <algorithm>
#include <map>

#include "protocol/dmx/patch.h"
#include "protocol/schema/console.pb.h"
#include "server/scene/apply_checks.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

bool at_one_place(const glm::dvec3& a, const glm::dvec3& b) {
    return glm::distance(a, b) <= kSamePlace_m;
}

std::string or_none(const std::string& addresses) {
    return addresses.empty() ? "none" : addresses;
}

const ImportedGroup* group_named(const Imported& imported, const std::string& name) {
    const auto at = std::ranges::find(imported.groups, name, &ImportedGroup::name);
    return at == imported.groups.end() ? nullptr : &*at;
}

std::vector<std::string> members(const ImportedGroup& group, const std::vector<std::string>& names) {
    std::vector<std::string> there;
    for (const std::uint32_t index : group.lights)
        if (index < names.size() && !names[index].empty()) there.push_back(names[index]);
    return there;
}

bool holds(const std::vector<std::string>& names, const std::string& name) {
    return std::ranges::find(names, name) != names.end();
}

}  // namespace

bool differ(const glm::dquat& a, const glm::dquat& b) {
    return 1.0 - std::abs(glm::dot(a, b)) > 1e-11;  // of an angle of a² / 8
}

void follow_merge(LightValues& values, const MergedLight& merged, const Light& light) {
    if (merged.moved &&
        (at_one_place(values.position, merged.position) || at_one_place(values.position, merged.before.position)))
        values.position = light.position;
    if (merged.other_profile && values.profile == merged.before.profile) values.profile = light.profile;
    const bool as_imported = !differ(values.world_from_light, merged.world_from_light);
    if (as_imported && merged.turned) {
        values.world_from_light = light.world_from_light;
        values.pan_rad = light.pan_rad, values.tilt_rad = light.tilt_rad, values.roll_rad = light.roll_rad;
    } else if (!as_imported && merged.mounted) {
        values.world_from_light =
            glm::normalize(light.world_from_mount * orientation_of({values.pan_rad, values.tilt_rad, values.roll_rad}));
    }
}

std::shared_ptr<const v1::SetPatch> merged_patch(const Scene& before, const SceneAsset& asset,
                                                 const std::vector<MergedRows>& lights,
                                                 const std::shared_ptr<const v1::SetPatch>& patch,
                                                 MergeReport& report) {
    if (!patch && std::ranges::any_of(lights, [](const MergedRows& light) { return !light.was.empty(); })) {
        report.add(MergeLine::kept, "patch", "the default one");
        return nullptr;
    }
    const auto ours = row_digests(patch.get());
    std::map<std::string, std::string> of_file;  // the light in the scene, by the target in the file
    std::set<std::string> replaced;
    for (const MergedRows& light : lights) {
        const auto found = ours.find(light.light);
        const std::string own = found == ours.end() ? "" : found->second;
        const bool changed = light.now != light.was && !light.file.empty(), edited = own != light.was;
        if (changed && !light.fresh)
            report.add(MergeLine::patched, light.light,
                       or_none(light.addresses_was) + " -> " + or_none(light.addresses_now));
        if (changed && edited && own != light.now && !light.fresh)
            report.add(MergeLine::conflict, light.light, "was patched here too: the file counts");
        if (!changed && edited) report.add(MergeLine::kept, light.light, "its patch");
        if (light.file.empty() || (!changed && edited)) continue;
        of_file[light.file] = light.light;
        replaced.insert(light.light);
    }
    v1::SetPatch merged;
    if (asset.patch)
        for (const v1::PatchRow& row : asset.patch->rows())
            if (const auto at = of_file.find(row.target()); at != of_file.end()) {
                *merged.add_rows() = row;
                merged.mutable_rows(merged.rows_size() - 1)->set_target(at->second);
            }
    if (patch)
        for (const v1::PatchRow& row : patch->rows())
            if (!replaced.contains(row.target())) *merged.add_rows() = row;
    if (!patch && merged.rows_size() == 0) return nullptr;
    if (const auto checked = check_patch(merged); !checked) throw Refused{checked.error()};
    // A patch that is the file's own goes with it, as before.
    const bool own =
        patch == before.asset->patch && asset.patch && asset.patch->SerializeAsString() == merged.SerializeAsString();
    return own ? asset.patch : std::make_shared<const v1::SetPatch>(std::move(merged));
}

void merge_groups(Scene& scene, const Imported& was, const std::vector<std::string>& names_was, const Imported& now,
                  const std::vector<std::string>& names_now, MergeReport& report) {
    const auto is_missing = [&](const std::string& name) {
        const Light* light = find_light(scene, name);
        return light != nullptr && light->missing;
    };
    std::map<std::string, std::vector<std::string>> wanted;  // of the groups that the file speaks of
    for (const ImportedGroup& group : now.groups) wanted[group.name] = members(group, names_now);
    for (const ImportedGroup& group : was.groups) wanted.try_emplace(group.name);
    for (const auto& [name, lights] : wanted) {
        const ImportedGroup* const before = group_named(was, name);
        const auto there = scene.groups.find(name);
        if (there == scene.groups.end()) {
            if (lights.empty()) continue;
            if (before != nullptr)
                report.add(MergeLine::kept, name, "this group was removed here");
            else if (find_light(scene, name) != nullptr || scene.groups.size() >= kMaxGroups)
                report.add(MergeLine::left_out, name,
                           find_light(scene, name) != nullptr ? "a light has the name of this group"
                                                              : "a group beyond the " + std::to_string(kMaxGroups));
            else
                report.add(MergeLine::group, name, "is new"), scene.groups[name] = lights;
            continue;
        }
        if (before == nullptr) continue;  // somebody's own
        const std::vector<std::string> base = members(*before, names_was);
        std::vector<std::string> merged;
        for (const std::string& light : there->second)
            if (holds(lights, light) || !holds(base, light) || is_missing(light)) merged.push_back(light);
        for (const std::string& light : lights)
            if (!holds(base, light) && !holds(merged, light)) merged.push_back(light);
        if (merged == there->second) continue;
        report.add(MergeLine::group, name,
                   merged.empty() ? "is gone" : "has " + std::to_string(merged.size()) + " lights");
        if (merged.empty())
            scene.groups.erase(there);
        else
            there->second = std::move(merged);
    }
}

}  // namespace gonio
