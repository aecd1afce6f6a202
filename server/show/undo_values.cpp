#include "server/show/undo_values.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <utility>

#include "protocol/schema/console.pb.h"
#include "protocol/schema/cue.pb.h"
#include "protocol/schema/cue_number.h"
#include "protocol/schema/grid.pb.h"
#include "protocol/schema/surface.pb.h"
#include "server/assets/assets.h"
#include "server/scene/apply_light.h"
#include "server/scene/cue.h"
#include "server/scene/gel.h"
#include "server/scene/light_tables.h"
#include "server/scene/light_values.h"
#include "server/scene/opening.h"
#include "server/scene/orientation.h"
#include "server/scene/scene.h"
#include "server/show/saved_profile.h"
#include "server/show/show_restorer.h"

namespace gonio {
namespace {

void add_all(saved::UndoNumbers& out, std::initializer_list<double> numbers) {
    for (const double number : numbers) out.add_values(number);
}

bool all_finite(const auto& numbers) {
    return std::ranges::all_of(numbers, [](double number) { return std::isfinite(number); });
}

// Whether a quaternion turns.
bool is_turn(const auto& xyzw) {
    return std::abs(std::hypot(std::hypot(xyzw[0], xyzw[1]), std::hypot(xyzw[2], xyzw[3])) - 1.0) < 1e-3;
}

// Result: nothing where there are not so many, or one is no finite number.
template <std::size_t Count>
std::optional<std::array<double, Count>> numbers_in(const google::protobuf::RepeatedField<double>& values) {
    if (values.size() != static_cast<int>(Count) || !all_finite(values)) return std::nullopt;
    std::array<double, Count> numbers{};
    std::copy(values.begin(), values.end(), numbers.begin());
    return numbers;
}

struct ValueOf {
    saved::UndoValue::ValueCase kind;
    bool or_absent = false;  // there may be none of it
};
// Of each EditKind.
ValueOf value_of_kind(EditKind kind) {
    using Value = saved::UndoValue;
    switch (kind) {
        case EditKind::light:
            return {Value::kLight, true};
        case EditKind::name:
            return {Value::kText, true};
        case EditKind::aim:
            return {Value::kOrientation, true};
        case EditKind::numbers:
            return {Value::kNumbers, true};
        case EditKind::profile:
            return {Value::kProfile, true};
        case EditKind::gel:
            return {Value::kGel, true};
        case EditKind::opening:
            return {Value::kOpening, true};
        case EditKind::group:
            return {Value::kLights, true};
        case EditKind::preset:
            return {Value::kPreset, true};
        case EditKind::cue:
            return {Value::kCue, true};
        case EditKind::recalled:
            return {Value::kText};
        case EditKind::patch:
            return {Value::kPatch};
        case EditKind::surfaces:
            return {Value::kSurfaces};
        case EditKind::grid:
            return {Value::kGrid, true};
        case EditKind::observer:
            return {Value::kObserver, true};
        case EditKind::haze:
            return {Value::kHaze};
        case EditKind::master:
            return {Value::kNumber};
        case EditKind::view_light:
            return {Value::kId};
    }
    return {Value::VALUE_NOT_SET};
}

// Several kinds of value have two ways to be written.
saved::UndoValue::ValueCase plain(saved::UndoValue::ValueCase kind) {
    using Value = saved::UndoValue;
    return kind == Value::kSceneProfile ? Value::kProfile
           : kind == Value::kNoPatch    ? Value::kPatch
           : kind == Value::kNoSurfaces ? Value::kSurfaces
                                        : kind;
}

}  // namespace

void UndoValueWriter::put(const EditKey& key, saved::UndoKey& out) const {
    out.set_kind(static_cast<std::uint32_t>(key.kind));
    out.set_light(key.light);
    if (key.kind == EditKind::numbers) out.set_property(std::string(row_of(key.property).name));
    out.set_name(key.name);
    out.set_cue(key.cue);
}

template <typename Out>
void UndoValueWriter::put_profile(const std::shared_ptr<const Profile>& profile, Out& out) {
    const auto& seeds = scene_.asset->lights;
    if (const auto seed = std::ranges::find(seeds, profile, &LightSeed::profile); seed != seeds.end())
        return out.set_scene_profile(seed->name);
    const ProfileTexts::Text& text = texts_.of(profile);
    out.set_profile(text.key);
    if (!profiles_.insert(text.key).second) return;
    texts_.put(profile, *out_.add_profiles());
}

void UndoValueWriter::put_light(const LightValues& light, const std::string& name, saved::Light& out) {
    out.set_name(name);
    for (const LightRow& light_row : light_rows())
        write_numbers(out, row_of(light_row.property).field, light_row, numbers_of(light, light_row));
    if (light.gel) out.set_gel(light.gel->name);
    if (light.opening) out.set_opening(print_opening(*light.opening));
    put_profile(light.profile, out);
}

std::uint32_t UndoValueWriter::index_of(const std::shared_ptr<const Preset>& preset) {
    const auto [at, fresh] = presets_.try_emplace(preset, static_cast<std::uint32_t>(out_.presets_size()));
    if (!fresh) return at->second;
    saved::UndoPreset& out = *out_.add_presets();
    for (const auto& [name, shared] : scene_.presets) {
        if (shared != preset) continue;
        out.set_preset(name);
        return at->second;
    }
    if (scene_.cues) {
        for (const auto& cue : *scene_.cues) {
            if (cue->content != preset) continue;
            out.set_cue(cue->number);
            return at->second;
        }
    }
    for (const PresetLight& light : *preset) put_light(light, light.name, *out.mutable_own()->add_lights());
    out.mutable_own();
    return at->second;
}

void UndoValueWriter::put(const EditValue& value, saved::UndoValue& out) {
    if (const auto* existing = std::get_if<ExistingLight>(&value)) {
        saved::UndoExistingLight& kept = *out.mutable_light();
        if (!existing->light) return;
        const Light& light = *existing->light;
        put_light(light, light.name, *kept.mutable_light());
        kept.set_seed(light.seed);
        const glm::dquat& turn = light.world_from_light;
        for (const double part : {turn.x, turn.y, turn.z, turn.w}) kept.add_orientation_xyzw(part);
        const glm::dquat& mount = light.world_from_mount;
        for (const double part : {mount.x, mount.y, mount.z, mount.w}) kept.mutable_light()->add_mount_xyzw(part);
        kept.mutable_light()->set_multiplier(light.multiplier);
        kept.mutable_light()->set_sun(light.sun);
        kept.mutable_light()->set_missing(light.missing);
        if (light.imported >= 0) kept.mutable_light()->set_imported(static_cast<std::uint32_t>(light.imported));
    } else if (const auto* text = std::get_if<std::string>(&value)) {
        out.set_text(*text);
    } else if (const auto* aim = std::get_if<Orientation>(&value)) {
        const glm::dquat& turn = aim->world_from_light;
        add_all(*out.mutable_orientation(),
                {turn.x, turn.y, turn.z, turn.w, aim->pan_rad, aim->tilt_rad, aim->roll_rad});
    } else if (const auto* numbers = std::get_if<Numbers>(&value)) {
        for (const double number : *numbers) out.mutable_numbers()->add_values(number);
    } else if (const auto* profile = std::get_if<std::shared_ptr<const Profile>>(&value)) {
        put_profile(*profile, out);
    } else if (const auto* gel = std::get_if<std::shared_ptr<const Gel>>(&value)) {
        out.set_gel(*gel ? (*gel)->name : "");
    } else if (const auto* ids = std::get_if<LightIds>(&value)) {
        out.mutable_lights()->mutable_ids()->Add(ids->begin(), ids->end());
    } else if (const auto* preset = std::get_if<std::shared_ptr<const Preset>>(&value)) {
        out.set_preset(index_of(*preset));
    } else if (const auto* cue = std::get_if<std::shared_ptr<const Cue>>(&value)) {
        put_cue(**cue, *out.mutable_cue()->mutable_cue());
        out.mutable_cue()->set_content(index_of((*cue)->content));
    } else if (const auto* patch = std::get_if<std::shared_ptr<const v1::SetPatch>>(&value)) {
        *patch ? void(*out.mutable_patch() = **patch) : out.set_no_patch(true);
    } else if (const auto* surfaces = std::get_if<std::shared_ptr<const v1::SetSurfaces>>(&value)) {
        *surfaces ? void(*out.mutable_surfaces() = **surfaces) : out.set_no_surfaces(true);
    } else if (const auto* grid = std::get_if<std::shared_ptr<const v1::Grid>>(&value)) {
        *out.mutable_grid() = **grid;
    } else if (const auto* observer = std::get_if<std::shared_ptr<const v1::Observer>>(&value)) {
        *out.mutable_observer() = **observer;
    } else if (const auto* opening = std::get_if<std::optional<ies::Opening>>(&value)) {
        out.set_opening(*opening ? print_opening(**opening) : "");
    } else if (const auto* haze = std::get_if<HazeValues>(&value)) {
        add_all(*out.mutable_haze(), {haze->extinction_per_m, haze->albedo, haze->g, haze->layer_height_m});
    } else if (const auto* number = std::get_if<double>(&value)) {
        out.set_number(*number);
    } else if (const auto* id = std::get_if<std::uint32_t>(&value)) {
        out.set_id(*id);
    }
}

UndoValueReader::UndoValueReader(const saved::UndoSteps& steps, const Scene& scene) : scene_(scene) {
    read_profiles(steps);
    read_presets(steps);
}

void UndoValueReader::read_profiles(const saved::UndoSteps& steps) {
    const auto until = std::chrono::steady_clock::now() + kProfileTime;
    ProfileTexts texts;
    const auto of_scene = [&](const saved::Profile& wanted) -> std::shared_ptr<const Profile> {
        for (const Light& light : scene_.lights)
            if (light.profile->name == wanted.name() && texts.of(light.profile).key == wanted.key())
                return light.profile;
        return nullptr;
    };
    for (const saved::Profile& profile : steps.profiles()) {
        if (auto own = of_scene(profile)) {
            profiles_[profile.key()] = std::move(own);
            continue;
        }
        if (std::chrono::steady_clock::now() > until) continue;  // steps that need it are dropped
        std::vector<std::string> warnings;
        if (const auto own = restored_profile(profile, warnings); own && warnings.empty())
            profiles_[profile.key()] = *own;
    }
}

void UndoValueReader::read_presets(const saved::UndoSteps& steps) {
    for (const saved::UndoPreset& preset : steps.presets()) {
        if (preset.has_preset()) {
            const auto found = scene_.presets.find(preset.preset());
            presets_.push_back(found == scene_.presets.end() ? nullptr : found->second);
            continue;
        }
        if (preset.has_cue()) {
            const Cue* const cue = find_cue(scene_, preset.cue());
            presets_.push_back(cue == nullptr ? nullptr : cue->content);
            continue;
        }
        Preset lights;
        bool whole = true;
        for (const saved::Light& saved : preset.own().lights()) {
            PresetLight light;
            light.name = saved.name();
            whole = whole && read_light(saved, light);
            lights.push_back(std::move(light));
        }
        presets_.push_back(whole ? std::make_shared<const Preset>(std::move(lights)) : nullptr);
    }
}

std::shared_ptr<const Profile> UndoValueReader::seed_profile(const std::string& name) const {
    const LightSeed* seed = seed_named(*scene_.asset, name);
    return seed == nullptr ? nullptr : seed->profile;
}

std::shared_ptr<const Profile> UndoValueReader::kept_profile(const std::string& key) const {
    const auto found = profiles_.find(key);
    return found == profiles_.end() ? nullptr : found->second;
}

std::optional<std::shared_ptr<const Gel>> UndoValueReader::gel(const std::string& name) const {
    if (name.empty()) return std::shared_ptr<const Gel>();
    auto found = find_gel(scene_.gels.get(), name);
    if (!found) return std::nullopt;
    return found;
}

// Result: false where something of it is not there any more.
bool UndoValueReader::read_light(const saved::Light& saved, LightValues& light) const {
    for (const LightRow& light_row : light_rows()) {
        const std::vector<double> kept = read_numbers(saved, row_of(light_row.property).field);
        Numbers numbers{};
        if (kept.size() != count_of(light_row) || !all_finite(kept)) return false;
        std::ranges::copy(kept, numbers.begin());
        set_numbers(light, light_row, numbers);
    }
    light.world_from_light = orientation_of({light.pan_rad, light.tilt_rad, light.roll_rad});
    const auto filter = gel(saved.gel());
    if (!filter) return false;
    light.gel = *filter;
    light.opening = parse_opening(saved.opening());
    if (!saved.opening().empty() && !light.opening) return false;
    light.profile = saved.has_scene_profile() ? seed_profile(saved.scene_profile()) : kept_profile(saved.profile());
    return light.profile != nullptr;
}

std::optional<EditValue> UndoValueReader::existing_light(std::uint32_t id,
                                                         const saved::UndoExistingLight& saved) const {
    auto light = std::make_shared<Light>();
    const auto turn = numbers_in<4>(saved.orientation_xyzw()), mount = numbers_in<4>(saved.light().mount_xyzw());
    const bool seeded = saved.seed() >= 0;
    if (!read_light(saved.light(), *light) || !turn || !mount) return std::nullopt;
    if (!std::isfinite(saved.light().multiplier()) || !is_turn(*turn) || !is_turn(*mount)) return std::nullopt;
    if (seeded && static_cast<std::size_t>(saved.seed()) >= scene_.asset->lights.size()) return std::nullopt;
    light->id = id;
    light->name = saved.light().name();
    light->seed = seeded ? saved.seed() : -1;
    light->world_from_light = glm::dquat((*turn)[3], (*turn)[0], (*turn)[1], (*turn)[2]);
    light->world_from_mount = glm::dquat((*mount)[3], (*mount)[0], (*mount)[1], (*mount)[2]);
    light->multiplier = saved.light().multiplier();
    light->sun = saved.light().sun();
    light->missing = saved.light().missing();
    light->imported = saved.light().has_imported() ? static_cast<int>(saved.light().imported()) : -1;
    follow_values(*light);
    return ExistingLight{std::move(light)};
}

std::optional<EditValue> UndoValueReader::cue(const saved::UndoCue& saved) const {
    if (saved.content() >= presets_.size() || !presets_[saved.content()]) return std::nullopt;
    const v1::Cue& kept = saved.cue();
    const auto number = parse_cue_number(kept.number());
    if (!number) return std::nullopt;
    Cue cue;
    cue.number = *number;
    cue.label = kept.label();
    cue.up_s = kept.up_s();
    cue.down_s = kept.down_s();
    cue.delay_up_s = kept.delay_up_s();
    cue.delay_down_s = kept.delay_down_s();
    for (const double time_s : {cue.up_s, cue.down_s, cue.delay_up_s, cue.delay_down_s, kept.follow_s(), kept.hang_s()})
        if (!(time_s >= 0.0 && time_s <= kMaxCueTime_s)) return std::nullopt;
    if (kept.has_follow_s()) cue.follow_s = kept.follow_s();
    if (kept.has_hang_s()) cue.hang_s = kept.hang_s();
    if (!kept.timecode().empty() && !(cue.timecode = parse_timecode(kept.timecode()))) return std::nullopt;
    cue.content = presets_[saved.content()];
    return std::make_shared<const Cue>(std::move(cue));
}

std::optional<EditKey> UndoValueReader::key(const saved::UndoKey& saved) const {
    if (saved.kind() > static_cast<std::uint32_t>(EditKind::view_light) || saved.light() >= scene_.next_light_id)
        return std::nullopt;
    EditKey key{static_cast<EditKind>(saved.kind()), saved.light(), {}, saved.name(), saved.cue()};
    if (key.kind != EditKind::numbers) return key;
    const PropertyRow* row = find_property(saved.property());
    if (row == nullptr || light_row_of(row->property) == nullptr) return std::nullopt;
    key.property = row->property;
    return key;
}

std::optional<EditValue> UndoValueReader::value(const EditKey& key, const saved::UndoValue& saved) const {
    using Value = saved::UndoValue;
    const ValueOf wanted = value_of_kind(key.kind);
    if (saved.value_case() == Value::VALUE_NOT_SET) return wanted.or_absent ? std::optional(EditValue()) : std::nullopt;
    if (plain(saved.value_case()) != wanted.kind) return std::nullopt;
    switch (saved.value_case()) {
        case Value::kLight:
            return existing_light(key.light, saved.light());
        case Value::kText:
            return saved.text();
        case Value::kOrientation: {
            const auto n = numbers_in<7>(saved.orientation().values());
            if (!n || !is_turn(*n)) return std::nullopt;
            return Orientation{glm::dquat((*n)[3], (*n)[0], (*n)[1], (*n)[2]), (*n)[4], (*n)[5], (*n)[6]};
        }
        case Value::kNumbers: {
            const auto numbers = numbers_in<3>(saved.numbers().values());
            return numbers ? std::optional(EditValue(*numbers)) : std::nullopt;
        }
        case Value::kSceneProfile:
        case Value::kProfile: {
            auto profile =
                saved.has_scene_profile() ? seed_profile(saved.scene_profile()) : kept_profile(saved.profile());
            return profile ? std::optional(EditValue(std::move(profile))) : std::nullopt;
        }
        case Value::kGel: {
            auto filter = gel(saved.gel());
            return filter ? std::optional(EditValue(std::move(*filter))) : std::nullopt;
        }
        case Value::kLights:
            return LightIds(saved.lights().ids().begin(), saved.lights().ids().end());
        case Value::kPreset: {
            const bool there = saved.preset() < presets_.size() && presets_[saved.preset()];
            return there ? std::optional(EditValue(presets_[saved.preset()])) : std::nullopt;
        }
        case Value::kCue:
            return cue(saved.cue());
        case Value::kPatch:
            return std::make_shared<const v1::SetPatch>(saved.patch());
        case Value::kNoPatch:
            return std::shared_ptr<const v1::SetPatch>();
        case Value::kSurfaces:
            return std::make_shared<const v1::SetSurfaces>(saved.surfaces());
        case Value::kNoSurfaces:
            return std::shared_ptr<const v1::SetSurfaces>();
        case Value::kGrid:
            return std::make_shared<const v1::Grid>(saved.grid());
        case Value::kObserver:
            return std::make_shared<const v1::Observer>(saved.observer());
        case Value::kOpening: {
            const auto opening = parse_opening(saved.opening());
            if (!saved.opening().empty() && !opening) return std::nullopt;
            return opening;
        }
        case Value::kHaze: {
            const auto n = numbers_in<4>(saved.haze().values());
            return n ? std::optional(EditValue(HazeValues{(*n)[0], (*n)[1], (*n)[2], (*n)[3]})) : std::nullopt;
        }
        case Value::kNumber:
            return std::isfinite(saved.number()) ? std::optional(EditValue(saved.number())) : std::nullopt;
        case Value::kId:
            return saved.id();
        case Value::VALUE_NOT_SET:
            break;
    }
    return std::nullopt;
}

}  // namespace gonio
