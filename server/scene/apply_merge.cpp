#include "server/scene/apply_merge.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "ies/core/printed.h"
#include "protocol/schema/scene.pb.h"
#include "server/scene/apply_checks.h"
#include "server/scene/apply_light.h"
#include "server/scene/apply_rename.h"
#include "server/scene/apply_show.h"
#include "server/scene/cue.h"
#include "server/scene/light_tables.h"
#include "server/scene/limits.h"
#include "server/scene/merge_match.h"
#include "server/scene/merge_parts.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

std::string type_words(const ImportedLight& light) {
    return light.type + (light.mode.empty() ? "" : ", " + light.mode);
}

class Merge {
public:
    Merge(const Scene& before, Scene& fresh, const Imported& was, std::vector<std::string>& warnings)
        : before_(before),
          fresh_(fresh),
          was_(was),
          asset_(*fresh.asset),
          file_(scene_of(fresh.asset, fresh.scene_rev + 1)),
          now_(std::make_shared<Imported>(*file_.imported)),
          matches_(match_lights(was, *now_)),
          warnings_(warnings) {}

    MergeReport run() {
        merge_lights();
        rename_lights();
        lose_lights();
        add_lights();
        follow_presets();
        merge_patch_and_groups();
        fresh_.imported = now_;
        return std::move(report_);
    }

private:
    Light* light_of(int index) {
        const auto at = std::ranges::find(fresh_.lights, index, &Light::imported);
        return index < 0 || at == fresh_.lights.end() ? nullptr : &*at;
    }

    // Result: whether somebody gave the light a profile of its own.
    bool has_own_web(const Light& light, const ImportedLight& was) const {
        if (light.seed < 0) return was.own_web;
        return light.profile != before_.asset->lights[static_cast<std::size_t>(light.seed)].profile;
    }

    void merge_lights() {
        places_.assign(now_->lights.size(), -1);
        for (std::size_t i = 0; i < now_->lights.size(); ++i) {
            const Match& match = matches_[i];
            Light* const light = light_of(match.was);
            if (light == nullptr) continue;
            places_[i] = static_cast<int>(light - fresh_.lights.data());
            merge_light(*light, was_.lights[static_cast<std::size_t>(match.was)], i);
            if (match.by == MatchedBy::number) report_.add(MergeLine::matched, light->name, "by its number and type");
            if (match.by == MatchedBy::place) report_.add(MergeLine::matched, light->name, "by its name and place");
        }
        for (std::size_t i = 0; i < places_.size(); ++i) {  // once all are found: indices of both editions overlap
            if (places_[i] < 0) continue;
            Light& light = fresh_.lights[static_cast<std::size_t>(places_[i])];
            light.imported = light.seed = static_cast<int>(i);
            matched_.insert(light.id);
        }
    }

    void merge_light(Light& light, const ImportedLight& was, std::size_t index) {
        const ImportedLight& now = now_->lights[index];
        const Light& file = file_.lights[index];
        MergedLight merged{.before = light, .position = was.position, .world_from_light = was.world_from_light};
        bool changed = light.missing || was.name != now.name || was.rows != now.rows;
        if (std::exchange(light.missing, false)) report_.add(MergeLine::back, light.name);
        merged.moved = glm::distance(was.position, now.position) > kSamePlace_m;
        const bool moved_here = glm::distance(was.position, light.position) > kSamePlace_m;
        if (merged.moved) {
            report_.add(MergeLine::moved, light.name,
                        printed("by %.4g m, to %.4g,%.4g,%.4g", glm::distance(was.position, now.position),
                                now.position.x, now.position.y, now.position.z));
            if (moved_here && glm::distance(light.position, now.position) > kSamePlace_m)
                report_.add(MergeLine::conflict, light.name, "was moved here too: the file counts");
            light.position = now.position;
        } else if (moved_here) {
            report_.add(MergeLine::kept, light.name, "its place");
        }
        merged.turned = differ(was.world_from_light, now.world_from_light);
        merged.mounted = differ(light.world_from_mount, file.world_from_mount);
        light.world_from_mount = file.world_from_mount;
        if (!differ(was.world_from_light, light.world_from_light)) {
            if (merged.turned) report_.add(MergeLine::turned, light.name);
            if (merged.turned || merged.mounted) {
                light.world_from_light = file.world_from_light;
                light.pan_rad = file.pan_rad, light.tilt_rad = file.tilt_rad, light.roll_rad = file.roll_rad;
            }
        } else {
            if (merged.turned) report_.add(MergeLine::kept, light.name, "its aim");
            if (merged.mounted)  // pan and tilt stay, about axes that hang in another way
                light.world_from_light = glm::normalize(
                    light.world_from_mount * orientation_of({light.pan_rad, light.tilt_rad, light.roll_rad}));
        }
        const bool other_type = was.type != now.type || was.mode != now.mode;
        if (other_type) report_.add(MergeLine::mode, light.name, type_words(was) + " -> " + type_words(now));
        bool other_web = false;
        if (has_own_web(light, was)) {
            if (other_type) report_.add(MergeLine::kept, light.name, "its own profile");
        } else {
            other_web = !other_type && !is_same_web(*light.profile, *file.profile);
            if (other_web) report_.add(MergeLine::web, light.name, "shines in another way");
            merged.other_profile = true;
            light.profile = file.profile;
        }
        light.multiplier = file.multiplier;
        light.sun = file.sun;
        light.tilt_factor = tilt_factor_of(light);
        if (!changed && !merged.moved && !merged.turned && !other_type && !other_web) report_.add_unchanged();
        followed_.emplace(light.id, merged);
    }

    bool is_same_web(const Profile& one, const Profile& other) {
        const auto [at, fresh] = same_webs_.try_emplace({&one, &other}, false);
        if (fresh) at->second = one.photometry == other.photometry;
        return at->second;
    }

    struct Renaming {
        std::string before, wanted;
        bool taken;  // the wanted name is another's, as it was before the merge
    };

    // Where a name stays another's, the light keeps its own. So does then who wants that.
    void drop_taken_names(std::vector<Renaming>& renamings) {
        std::set<std::string> leaving;
        for (const Renaming& one : renamings) leaving.insert(one.before);
        const auto stays = [&](const Renaming& one) {
            if (!one.taken || leaving.contains(one.wanted)) return false;
            report_.add(MergeLine::kept, one.before, "its name: another light or group has \"" + one.wanted + "\"");
            leaving.erase(one.before);
            return true;
        };
        while (std::erase_if(renamings, stays) > 0) {
        }
    }

    void rename_lights() {
        std::vector<Renaming> renamings;
        for (std::size_t i = 0; i < places_.size(); ++i) {
            if (places_[i] < 0) continue;
            Light& light = fresh_.lights[static_cast<std::size_t>(places_[i])];
            const std::string& was = was_.lights[static_cast<std::size_t>(matches_[i].was)].name;
            const std::string& now = now_->lights[i].name;
            if (was == now || light.name == now) continue;
            if (light.name == was)
                renamings.push_back({light.name, now, is_taken(fresh_, now)});
            else
                report_.add(MergeLine::kept, light.name, "its name");
        }
        drop_taken_names(renamings);
        std::set<std::string> wanted, taken = names_taken();
        for (const Renaming& one : renamings) wanted.insert(one.wanted);
        for (const Renaming& one : renamings)
            if (wanted.contains(one.before)) taken.erase(one.before);  // it is left for another light
        std::map<std::string, std::string> new_by_old;
        for (const Renaming& one : renamings) {
            const std::string name = unused(one.wanted, taken);
            if (!wanted.contains(one.before)) taken.erase(one.before);
            taken.insert(name);
            new_by_old[one.before] = name;
            report_.add(MergeLine::renamed, one.before, "to \"" + name + "\"");
        }
        give_names(fresh_, new_by_old, warnings_);
    }

    std::set<std::string> names_taken() const {
        std::set<std::string> taken;
        for (const Light& light : fresh_.lights) taken.insert(light.name);
        for (const auto& [group, lights] : fresh_.groups) taken.insert(group);
        return taken;
    }

    // Result: the name, with a number behind it where it is taken.
    static std::string unused(const std::string& wanted, const std::set<std::string>& taken) {
        std::string name = wanted;
        for (int number = 2; taken.contains(name); ++number) {
            const std::string suffix = " " + std::to_string(number);
            name = shortened_text(wanted, kMaxNameBytes - suffix.size()) + suffix;
        }
        return name;
    }

    // Fixtures that are not in the file any more: dark, with all that names them.
    void lose_lights() {
        for (Light& light : fresh_.lights) {
            if (matched_.contains(light.id)) continue;
            if (light.imported < 0 || static_cast<std::size_t>(light.imported) >= was_.lights.size()) {
                light.seed = light.imported = -1;
                continue;
            }
            const auto index = static_cast<std::size_t>(light.imported);
            ImportedLight gone = was_.lights[index];
            gone.own_web = has_own_web(light, gone);
            gone.gone = true;
            if (!light.missing) report_.add(MergeLine::removed, light.name, "it stays dark");
            light.missing = true;
            light.seed = -1;
            light.imported = static_cast<int>(now_->lights.size());
            names_gone_[index] = light.name;
            now_->lights.push_back(std::move(gone));
        }
    }

    void add_lights() {
        std::set<std::string> taken = names_taken();
        for (std::size_t i = 0; i < places_.size(); ++i) {
            if (places_[i] >= 0) continue;
            const int was = matches_[i].was;
            if (was >= 0 && !was_.lights[static_cast<std::size_t>(was)].gone) {
                report_.add(MergeLine::kept, now_->lights[i].name, "was removed here");
                continue;
            }
            if (fresh_.lights.size() >= kMaxLights)
                refuse("too_many_lights", "load_scene.merge", now_->lights[i].name,
                       "a scene holds at most " + std::to_string(kMaxLights) + " lights, with those that are missing");
            Light light = file_.lights[i];
            light.id = fresh_.next_light_id++;
            light.name = unused(light.name, taken);
            taken.insert(light.name);
            report_.add(MergeLine::added, light.name);
            places_[i] = static_cast<int>(fresh_.lights.size());
            fresh_.lights.push_back(std::move(light));
        }
    }

    std::shared_ptr<const Preset> followed(const std::shared_ptr<const Preset>& preset) {
        const auto [at, fresh] = presets_.try_emplace(preset.get());
        if (!fresh) return at->second;
        auto changed = std::make_shared<Preset>(*preset);
        for (PresetLight& kept : *changed) {
            const Light* const light = find_light(fresh_, kept.name);
            if (light == nullptr) continue;
            if (const auto merged = followed_.find(light->id); merged != followed_.end())
                follow_merge(kept, merged->second, *light);
        }
        return at->second = std::move(changed);
    }

    // A preset that keeps a light where it hung keeps it where it hangs now.
    void follow_presets() {
        for (auto& [name, preset] : fresh_.presets) preset = followed(preset);
        if (!fresh_.cues) return;
        auto cues = std::make_shared<CueList>(*fresh_.cues);
        for (auto& cue : *cues) {
            auto changed = std::make_shared<Cue>(*cue);
            changed->content = followed(cue->content);
            cue = std::move(changed);
        }
        fresh_.cues = std::move(cues);
    }

    void merge_patch_and_groups() {
        std::vector<std::string> names_was(was_.lights.size()), names_now(now_->lights.size());
        std::vector<MergedRows> rows;
        for (std::size_t i = 0; i < places_.size(); ++i) {
            if (places_[i] < 0) continue;
            const ImportedLight& now = now_->lights[i];
            const Light& light = fresh_.lights[static_cast<std::size_t>(places_[i])];
            names_now[i] = light.name;
            const bool fresh = !matched_.contains(light.id);
            if (fresh) {
                rows.push_back({light.name, now.name, "", now.rows, "", now.addresses, fresh});
                continue;
            }
            const auto was = static_cast<std::size_t>(matches_[i].was);
            names_was[was] = light.name;
            const ImportedLight& before = was_.lights[was];
            rows.push_back({light.name, now.name, before.rows, now.rows, before.addresses, now.addresses, fresh});
        }
        for (const auto& [index, name] : names_gone_) names_was[index] = name;
        fresh_.patch = merged_patch(before_, asset_, rows, fresh_.patch, report_);
        merge_groups(fresh_, was_, names_was, *now_, names_now, report_);
    }

    const Scene& before_;
    Scene& fresh_;
    const Imported& was_;
    const SceneAsset& asset_;
    const Scene file_;  // the file alone
    const std::shared_ptr<Imported> now_;
    const std::vector<Match> matches_;  // of the lights of the file
    std::vector<std::string>& warnings_;
    MergeReport report_;
    std::vector<int> places_;                        // of the lights of the file, in fresh_.lights; -1: not there
    std::set<std::uint32_t> matched_;                // ids of lights
    std::map<std::size_t, std::string> names_gone_;  // of lights that are missing, by their index in was_
    std::map<std::uint32_t, MergedLight> followed_;  // by id
    std::map<const Preset*, std::shared_ptr<const Preset>> presets_;  // cues share those of presets
    std::map<std::pair<const Profile*, const Profile*>, bool> same_webs_;
};

}  // namespace

void merge_show(Scene& scene, const v1::LoadScene& load, const Loaded& loaded, std::vector<std::string>& lines) {
    const auto refuse_merge = [&](const std::string& value, const char* message) {
        refuse("unsupported", "load_scene.merge", shortened_text(value, 200), message);
    };
    if (!load.keep().empty())
        refuse("conflict", "load_scene.keep", load.keep(0), "a merge keeps all: it has no `keep`");
    if (!loaded.asset) refuse("invalid_argument", "load_scene.file", "", "no scene was loaded");
    if (!loaded.asset->imported) refuse_merge(loaded.asset->name, "only an MVR show can be merged");
    if (!scene.imported)
        refuse_merge(scene.asset->name, "the scene came from no MVR show: load the file without merge");
    if (loaded.asset->scale != scene.asset->scale)
        refuse("conflict", "load_scene.scale", print_number(loaded.asset->scale),
               "the scene was loaded with " + print_number(scene.asset->scale));
    if (const int offset = loaded.asset->imported->universe_offset; offset != scene.imported->universe_offset)
        refuse("conflict", "load_scene.universe_offset", std::to_string(offset),
               "the show was loaded with " + std::to_string(scene.imported->universe_offset));
    Scene fresh = scene;
    fresh.asset = loaded.asset;
    fresh.traced = loaded.traced;
    fresh.drawn = loaded.drawn;
    std::vector<std::string> warnings;
    MergeReport report = Merge(scene, fresh, *scene.imported, warnings).run();
    lines = report.lines(load.dry_run());
    lines.insert(lines.end(), warnings.begin(), warnings.end());
    if (load.dry_run()) return;
    renew_parts(fresh, scene.scene_rev + 1);
    scene = std::move(fresh);
}

}  // namespace gonio
