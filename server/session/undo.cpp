#include "server/session/undo.h"

#include <algorithm>
#include <set>
#include <utility>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/console.pb.h"
#include "protocol/schema/grid.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/scene.pb.h"
#include "protocol/schema/session.pb.h"
#include "protocol/schema/surface.pb.h"
#include "protocol/text/shortened_text.h"
#include "server/scene/cue.h"
#include "server/scene/scene.h"
#include "server/session/changes.h"

namespace gonio {
namespace {

// How one looks at the design is no part of it, nor is what is played of it.
bool is_look(const v1::Command& command) {
    return command.has_set_camera() || command.has_set_view() || command.has_set_exposure() || command.has_set_size() ||
           command.has_set_technique() || command.has_save_view() || command.has_recall_view() ||
           command.has_remove_view() || command.has_set_look() || command.has_set_cue_options() ||
           command.has_cue_go() || command.has_cue_back() || command.has_cue_stop() || command.has_cue_goto() ||
           command.has_cue_assert();
}

std::string light_label(const v1::SetLight& set) {
    std::vector<std::string> properties;
    for (const PropertyRow& row : property_table())
        if (!row.field.empty() && row.component < 0 && has_numbers(set, row.field)) properties.emplace_back(row.name);
    if (set.has_profile()) properties.emplace_back("profile");
    if (set.has_gel()) properties.emplace_back("gel");
    if (set.has_opening()) properties.emplace_back("opening");
    if (properties.empty()) return "change of " + set.name();
    if (properties.size() > 2) return std::to_string(properties.size()) + " properties of " + set.name();
    return properties.front() + (properties.size() == 2 ? " and " + properties[1] : "") + " of " + set.name();
}

std::string count_of_lights(int count) {
    return std::to_string(count) + (count == 1 ? " light" : " lights");
}

// Result: "level of 3 lights", "add 2 lights", "remove 5 lights".
std::string edit_label(const v1::EditLights& edit) {
    if (edit.add_size() > 0) return "add " + count_of_lights(edit.add_size());
    if (edit.remove_size() > 0) return "remove " + count_of_lights(edit.remove_size());
    v1::SetLight set = edit.same();  // which properties: those of all
    std::set<std::string> names(edit.names().begin(), edit.names().end());
    for (const v1::SetLight& each : edit.set()) {
        set.MergeFrom(each);
        names.insert(each.name());
    }
    set.set_name(names.size() == 1 ? *names.begin() : count_of_lights(static_cast<int>(names.size())));
    return light_label(set);
}

// Result: of a path, or of "upload:NAME".
std::string file_name(const std::string& file) {
    return shortened_text(file.substr(file.find_last_of("/:") + 1), 60);
}

// Result: what it does, in a few words. Of a command that changed something that undo knows.
std::string label_of(const v1::Command& command) {
    switch (command.command_case()) {
        case v1::Command::kSetLight:
            return light_label(command.set_light());
        case v1::Command::kAddLight:
            return "add " + command.add_light().light().name();
        case v1::Command::kEditLights:
            return edit_label(command.edit_lights());
        case v1::Command::kRemoveLight:
            return "remove " + command.remove_light().name();
        case v1::Command::kRenameLight:
            return "rename " + command.rename_light().name() + " to " + command.rename_light().new_name();
        case v1::Command::kSetGroup:
            return "group " + command.set_group().name();
        case v1::Command::kLoadScene:
            return (command.load_scene().merge() ? "merge " : "load ") + file_name(command.load_scene().file());
        case v1::Command::kOpenShow:
            return "open " + file_name(command.open_show().name());
        case v1::Command::kSetMaster:
            return "master";
        case v1::Command::kSetPatch:
            return "patch";
        case v1::Command::kSetSurfaces:
        case v1::Command::kMapControl:
            return "map of fader boxes";
        case v1::Command::kSavePreset:
            return "save preset " + command.save_preset().name();
        case v1::Command::kRecallPreset:
            return "recall preset " + command.recall_preset().name();
        case v1::Command::kRemovePreset:
            return "remove preset " + command.remove_preset().name();
        case v1::Command::kSetGrid:
            return "grid " + command.set_grid().grid().name();
        case v1::Command::kRemoveGrid:
            return "remove grid " + command.remove_grid().name();
        case v1::Command::kSetObserver:
            return "observer " + command.set_observer().observer().name();
        case v1::Command::kRemoveObserver:
            return "remove observer " + command.remove_observer().name();
        case v1::Command::kAddCue:
            return "add cue " + command.add_cue().number();
        case v1::Command::kSetCue:
            return "change of cue " + command.set_cue().number();
        case v1::Command::kRemoveCue:
            return "remove cue " + command.remove_cue().number();
        default:
            return "change";
    }
}

// Adds what a profile takes: its web twice, as it is and as it is prepared for lighting.
void add_profile(const std::shared_ptr<const Profile>& profile, std::set<const Profile*>& seen, std::size_t& bytes) {
    if (profile && seen.insert(profile.get()).second)
        bytes += sizeof(Profile) + 2 * sizeof(float) * profile->photometry.web.candela.size();
}

// Adds what a value takes beside itself, as if nobody shared it. Profiles count once a step.
void add_bytes(const EditValue& value, std::set<const Profile*>& seen, std::size_t& bytes) {
    if (const auto* text = std::get_if<std::string>(&value)) bytes += text->capacity();
    if (const auto* ids = std::get_if<LightIds>(&value)) bytes += ids->capacity() * sizeof(std::uint32_t);
    if (const auto* profile = std::get_if<std::shared_ptr<const Profile>>(&value)) add_profile(*profile, seen, bytes);
    if (const auto* existing = std::get_if<ExistingLight>(&value); existing != nullptr && existing->light) {
        bytes += sizeof(Light) + existing->light->name.capacity();
        add_profile(existing->light->profile, seen, bytes);
    }
    const auto add_preset = [&](const Preset& preset) {
        for (const PresetLight& light : preset) {
            bytes += sizeof(PresetLight) + light.name.capacity();
            add_profile(light.profile, seen, bytes);
        }
    };
    if (const auto* preset = std::get_if<std::shared_ptr<const Preset>>(&value)) add_preset(**preset);
    if (const auto* cue = std::get_if<std::shared_ptr<const Cue>>(&value)) {
        bytes += sizeof(Cue) + (*cue)->label.capacity();
        add_preset(*(*cue)->content);
    }
    if (const auto* grid = std::get_if<std::shared_ptr<const v1::Grid>>(&value)) bytes += (*grid)->SpaceUsedLong();
    if (const auto* observer = std::get_if<std::shared_ptr<const v1::Observer>>(&value))
        bytes += (*observer)->SpaceUsedLong();
    if (const auto* patch = std::get_if<std::shared_ptr<const v1::SetPatch>>(&value))
        bytes += *patch ? (*patch)->SpaceUsedLong() : 0;
    if (const auto* surfaces = std::get_if<std::shared_ptr<const v1::SetSurfaces>>(&value))
        bytes += *surfaces ? (*surfaces)->SpaceUsedLong() : 0;
}

// Result: what a scene's meshes and pictures take, and what is made of them.
std::size_t bytes_of(const SceneAsset& asset) {
    std::size_t bytes = 0;
    for (const Mesh& mesh : asset.meshes)
        bytes += sizeof(Vertex) * mesh.vertices.size() + sizeof(glm::u16vec4) * mesh.colors.size() +
                 sizeof(glm::vec4) * mesh.tangents.size() + sizeof(glm::vec2) * mesh.second_uv.size() +
                 sizeof(std::uint32_t) * mesh.indices.size();
    for (const Image& image : asset.images) bytes += image.rgba.size();
    constexpr std::size_t kPerTriangle = 200;  // of what rays and the raster go through
    return bytes + kPerTriangle * asset.triangles();
}

void say(std::vector<std::string>& warnings, std::size_t& untold, std::string text) {
    if (warnings.size() < kMaxUndoWarnings)
        warnings.push_back(std::move(text));
    else
        ++untold;
}

}  // namespace

void Undo::identify(std::uint32_t session, const std::string& undo_key, bool wants) {
    const std::string key = undo_key.empty() ? "session " + std::to_string(session) : "key " + undo_key;
    sessions_[session] = {key, wants, {}};
    if (const auto stack = stacks_.find(key); stack != stacks_.end()) stack->second.used = ++last_id_;
}

void Undo::forget_session(std::uint32_t session) {
    const auto found = sessions_.find(session);
    if (found == sessions_.end()) return;
    if (const std::string& key = found->second.key; ends_with_session(key)) {
        record_ = nullptr;
        drop_stack(key);
        // Nobody can go back past its loads any more.
        for (LeftScenes* scenes : {&earlier_, &later_})
            scenes->erase(scenes->begin(), std::find_if(scenes->rbegin(), scenes->rend(), [&](const auto& left) {
                                               return left->key == key;
                                           }).base());
    }
    sessions_.erase(found);
}

const Undo::Stack* Undo::stack_of(std::uint32_t session) const {
    const auto found = sessions_.find(session);
    if (found == sessions_.end()) return nullptr;
    const auto stack = stacks_.find(found->second.key);
    return stack == stacks_.end() ? nullptr : &stack->second;
}

Undo::Stack& Undo::open_stack(const std::string& key) {
    if (!stacks_.contains(key) && stacks_.size() >= kMaxUndoKeys)
        drop_stack(std::ranges::min_element(stacks_, {}, [](const auto& one) { return one.second.used; })->first);
    Stack& stack = stacks_[key];
    stack.used = ++last_id_;
    return stack;
}

void Undo::drop_stack(const std::string& key) {
    const auto found = stacks_.find(key);
    if (found == stacks_.end()) return;
    while (!found->second.steps.empty()) drop_step(found->second, found->second.steps.size() - 1);
    stacks_.erase(found);
}

void Undo::drop_step(Stack& stack, std::size_t index) {
    record_ = nullptr;
    const auto step = stack.steps.begin() + static_cast<std::ptrdiff_t>(index);
    for (const auto& [key, edit] : (*step)->edits) {
        const auto writer = writers_.find(key);
        if (--writer->second.uses == 0) writers_.erase(writer);
    }
    bytes_ -= (*step)->bytes;
    stack.steps.erase(step);
    if (index < stack.done) --stack.done;
}

void Undo::note_saved(const std::string& show_name) {
    record_ = nullptr;
    for (LeftScenes* scenes : {&earlier_, &later_}) {
        for (auto& left : *scenes) {
            if (!left->scene || left->scene->show_name != show_name) continue;
            auto unsaved = std::make_shared<Scene>(*left->scene);
            unsaved->show_rev = 0;
            auto other = std::make_shared<Left>(*left);
            other->scene = std::move(unsaved);
            other->kept = nullptr;  // it is written anew
            left = std::move(other);
        }
    }
}

// Result: the last of the scenes, if the session can go back to it, or nullptr.
const Undo::Left* Undo::left_by(std::uint32_t session, const LeftScenes& scenes) const {
    const auto found = sessions_.find(session);
    if (found == sessions_.end() || scenes.empty()) return nullptr;
    const std::string& key = scenes.back()->key;  // empty: of a console, or of a client that is gone
    return key.empty() || key == found->second.key ? scenes.back().get() : nullptr;
}

void Undo::leave(LeftScenes& to, const Scene& scene, const std::string& key, const std::string& label) {
    record_ = nullptr;
    UndoSteps steps{std::exchange(stacks_, {}), std::exchange(writers_, {}), std::exchange(bytes_, 0)};
    to.push_back(std::make_shared<const Left>(
        Left{std::make_shared<const Scene>(scene), key, label, std::move(steps), nullptr}));
}

void Undo::note_load(std::uint32_t session, const Scene& before, const Scene& after, const v1::Command& command) {
    later_.clear();
    const auto known = sessions_.find(session);
    const std::string key = known == sessions_.end() ? "" : known->second.key;
    if (const auto stack = stacks_.find(key); stack != stacks_.end())  // what it had undone
        while (stack->second.steps.size() > stack->second.done)
            drop_step(stack->second, stack->second.steps.size() - 1);
    leave(earlier_, before, key, label_of(command));
    keep_load_bounds(after);
}

void Undo::keep_load_bounds(const Scene& scene) {
    record_ = nullptr;
    const auto bytes = [&] {
        std::set<const SceneAsset*> seen{scene.asset.get()};
        std::size_t sum = 0;
        for (const LeftScenes* scenes : {&earlier_, &later_})
            for (const auto& left : *scenes)
                if (left->scene && seen.insert(left->scene->asset.get()).second) sum += bytes_of(*left->scene->asset);
        return sum;
    };
    for (LeftScenes* scenes : {&later_, &earlier_})
        while (!scenes->empty() && (scenes->size() > kMaxUndoLoads || bytes() > most_load_bytes_))
            scenes->erase(scenes->begin());
}

// The property has another value: whose, if a step knows it.
void Undo::write(const EditKey& key, const Scene& scene, std::uint64_t by, bool input) {
    const auto found = writers_.find(key);
    if (found == writers_.end()) return;
    Writer& writer = found->second;
    EditValue now = value_of(scene, key);
    if (now == writer.now) return;
    record_ = nullptr;
    writer.now = std::move(now);
    writer.step = by;
    writer.input = input;
}

void Undo::merge(Step& step, std::vector<Edit> edits, const Scene& after) {
    record_ = nullptr;
    for (Edit& edit : edits) {
        auto [entry, fresh] = step.edits.try_emplace(edit.key);
        Writer& writer = writers_[edit.key];
        UndoEdit& kept = entry->second;
        if (fresh) ++writer.uses;
        if (fresh || writer.step != step.id) {
            kept.before = std::move(edit.before);
            kept.before_writer = writer.step;
        }
        kept.after = std::move(edit.after);
        writer.step = step.id;
        writer.input = false;
        writer.now = value_of(after, edit.key);  // of a fade: where it begins
    }
    weigh(step);
}

void Undo::weigh(Step& step) {
    bytes_ -= step.bytes;
    std::set<const Profile*> seen;
    step.bytes = sizeof(Step) + step.label.capacity();
    for (const auto& [key, edit] : step.edits) {
        constexpr std::size_t kNodeBytes = 64;  // of a map, beside its value
        step.bytes += 2 * (sizeof key + kNodeBytes + key.name.capacity()) + sizeof edit + sizeof(Writer);
        add_bytes(edit.before, seen, step.bytes);
        add_bytes(edit.after, seen, step.bytes);
    }
    bytes_ += step.bytes;
}

void Undo::keep_bounds(Stack& stack) {
    if (stack.steps.size() > kMaxUndoSteps) drop_step(stack, 0);
    while (bytes_ > kMaxUndoBytes) {
        Stack* oldest = nullptr;
        for (auto& [key, one] : stacks_)
            if (!one.steps.empty() && (oldest == nullptr || one.steps.front()->id < oldest->steps.front()->id))
                oldest = &one;
        // What was undone can only be redone from its front.
        drop_step(*oldest, oldest->done > 0 ? 0 : oldest->steps.size() - 1);
    }
}

std::uint64_t Undo::note(std::uint32_t session, const Scene& before, const Scene& after, const v1::Command& command) {
    if (replaces_scene(command)) {
        note_load(session, before, after, command);
        return 0;
    }
    const auto known = sessions_.find(session);
    const bool fades = command.has_recall_preset() && command.recall_preset().fade_s() > 0;
    std::vector<Edit> edits;
    if (before.scene_rev != after.scene_rev) edits = edits_between(before, after);
    if (is_look(command) || known == sessions_.end()) {
        const std::uint64_t by = ++last_id_;
        for (const Edit& edit : edits) write(edit.key, after, by, known == sessions_.end());
        return 0;
    }
    if (fades)
        for (Edit& edit : edits_of_fade(after, *after.presets.at(command.recall_preset().name())))
            edits.push_back(std::move(edit));
    if (edits.empty()) return 0;
    Stack& stack = open_stack(known->second.key);
    if (left_by(session, later_) != nullptr) later_.clear();
    while (stack.steps.size() > stack.done) drop_step(stack, stack.steps.size() - 1);
    const bool goes_on = command.gesture() != 0 && !stack.steps.empty() && stack.steps.back()->session == session &&
                         stack.steps.back()->gesture == command.gesture();
    auto step = goes_on ? std::make_shared<Step>(*stack.steps.back()) : std::make_shared<Step>();
    if (!goes_on) {
        step->id = ++last_id_;
        step->session = session;
        step->gesture = command.gesture();
        step->label = label_of(command);
        stack.steps.emplace_back();
        ++stack.done;
    }
    const std::uint64_t id = step->id;
    merge(*step, std::move(edits), after);
    stack.steps.back() = std::move(step);
    keep_bounds(stack);
    return id;
}

void Undo::note_inputs(const Scene& after, Revision since, std::uint64_t fading) {
    if (writers_.empty() || after.scene_rev == since) return;
    const std::uint64_t by = fading != 0 ? fading : ++last_id_;
    const bool input = fading == 0;
    for (const Light& light : after.lights) {
        if (newest_rev(light) <= since) continue;
        for (const EditKey& key : keys_of(light.id)) write(key, after, by, input);
    }
    if (after.master_rev > since) write({EditKind::master, 0, {}, {}}, after, by, input);
    if (after.presets_rev <= since) return;
    write({EditKind::recalled, 0, {}, {}}, after, by, input);
    for (const auto& [name, preset] : after.presets) write({EditKind::preset, 0, {}, name}, after, by, input);
}

bool Undo::last_writer(const Step& step, const EditKey& key, bool redo) const {
    const UndoEdit& edit = step.edits.at(key);
    const std::uint64_t writer = writers_.at(key).step;
    return redo ? edit.undone && writer == edit.before_writer : writer == step.id;
}

// Whether the step may take the light away: nobody else has changed it or put it into a group.
bool Undo::can_go(const Step& step, std::uint32_t light, bool redo, const Scene& scene) const {
    for (const auto& [key, edit] : step.edits)
        if (is_of_light(key) && key.light == light && !last_writer(step, key, redo)) return false;
    const Light* there = light_of(scene, light);
    if (there == nullptr) return true;
    for (const auto& [name, lights] : scene.groups) {
        if (std::ranges::find(lights, there->name) == lights.end()) continue;
        const EditKey key{EditKind::group, 0, {}, name};
        if (!step.edits.contains(key) || !last_writer(step, key, redo)) return false;
    }
    return true;
}

Result<UndoPlan> Undo::plan(std::uint32_t session, bool redo, const Scene& scene) const {
    const char* const what = redo ? "redo" : "undo";
    const Stack* stack = stack_of(session);
    const std::size_t index = stack == nullptr ? 0 : redo ? stack->done : stack->done - 1;
    if (stack == nullptr || index >= stack->steps.size()) {  // of unsigned numbers: also -1
        const LeftScenes& scenes = redo ? later_ : earlier_;
        if (const Left* left = left_by(session, scenes)) {
            if (!left->scene) return Error{"busy", what, "", "the scene before is still being read"};
            UndoPlan plan{{}, left->scene, {}, 0, left->label};
            const std::string& own = sessions_.at(session).key;
            if (!redo &&
                std::ranges::any_of(stacks_, [&](const auto& one) { return one.first != own && one.second.done > 0; }))
                plan.warnings.emplace_back("what other clients changed since goes with it");
            return plan;
        }
        const auto known = sessions_.find(session);
        const bool loaded = !redo && known != sessions_.end() && !scenes.empty() &&
                            scenes.back()->steps.stacks.contains(known->second.key);
        return Error{"not_found", what, "",
                     std::string("nothing to ") + what + (loaded ? ": a scene or a show was loaded since" : "")};
    }
    const Step& step = *stack->steps[index];
    UndoPlan plan{{}, {}, {}, step.id, step.label};
    std::size_t untold = 0;
    std::set<std::uint32_t> staying;  // lights that come or go with the step, and may not
    for (const auto& [key, edit] : step.edits) {
        if (is_of_light(key) && light_of(scene, key.light) == nullptr &&
            !step.edits.contains({EditKind::light, key.light, {}, {}})) {
            say(plan.warnings, untold, words_of(scene, key) + " stays");
            continue;
        }
        const EditValue& value = redo ? edit.after : edit.before;
        const bool goes = key.kind == EditKind::light && std::holds_alternative<std::monostate>(value);
        const bool writes = goes ? can_go(step, key.light, redo, scene) : last_writer(step, key, redo);
        if (key.kind == EditKind::light && !writes) staying.insert(key.light);
        if (writes && !(is_of_light(key) && staying.contains(key.light))) {
            plan.targets.push_back({key, value});
            continue;
        }
        const bool told = redo && !edit.undone;  // when it was undone
        const bool part = key.kind != EditKind::light && is_of_light(key) && staying.contains(key.light);
        if (told || part || key.kind == EditKind::recalled || key.kind == EditKind::view_light) continue;
        say(plan.warnings, untold,
            words_of(scene, key) + " was changed since by " +
                (writers_.at(key).input ? "a console or a fader box" : "another client") + " and stays");
    }
    if (untold > 0) plan.warnings.push_back("and " + std::to_string(untold) + " more");
    return plan;
}

std::vector<Edit> Undo::carried_out(std::uint32_t session, bool redo, const UndoPlan& plan, const Scene& before,
                                    const Scene& after) {
    if (plan.scene) {
        LeftScenes &from = redo ? later_ : earlier_, &to = redo ? earlier_ : later_;
        const std::shared_ptr<const Left> left = from.back();
        from.pop_back();
        leave(to, before, left->key, left->label);
        stacks_ = left->steps.stacks, writers_ = left->steps.writers, bytes_ = left->steps.bytes;
        keep_load_bounds(after);
        return {};
    }
    record_ = nullptr;
    Stack& stack = stacks_.at(sessions_.at(session).key);
    stack.used = ++last_id_;
    const std::size_t index = redo ? stack.done : stack.done - 1;
    const auto changed = std::make_shared<Step>(*stack.steps[index]);
    Step& step = *changed;
    for (auto& [key, edit] : step.edits) edit.undone = false;
    for (const auto& [key, value] : plan.targets) {
        Writer& writer = writers_.at(key);
        EditValue now = value_of(after, key);
        UndoEdit& edit = step.edits.at(key);
        if (now != value) continue;  // it could not be set back
        writer.now = std::move(now);
        writer.step = redo ? step.id : edit.before_writer;
        writer.input = false;
        edit.undone = !redo;
    }
    // What gave way besides: a preset that names a renamed light.
    const std::uint64_t by = ++last_id_;
    std::vector<Edit> edits = edits_between(before, after);
    for (const Edit& edit : edits) write(edit.key, after, by, false);
    const bool any = std::ranges::any_of(step.edits, [](const auto& one) { return one.second.undone; });
    stack.steps[index] = changed;
    if (redo)
        ++stack.done;
    else if (any)
        --stack.done;
    else
        drop_step(stack, index);
    return edits;
}

std::shared_ptr<const UndoRecord> Undo::record() const {
    if (record_) return record_;
    auto record = std::make_shared<UndoRecord>();
    record->steps = {stacks_, writers_, bytes_};
    record->last_id = last_id_;
    for (auto left = earlier_.rbegin(); left != earlier_.rend() && !ends_with_session((*left)->key); ++left)
        record->earlier.insert(record->earlier.begin(), *left);
    return record_ = std::move(record);
}

void Undo::go_on(const UndoRecord& record, const Scene& scene) {
    stacks_ = record.steps.stacks, writers_ = record.steps.writers;
    earlier_ = record.earlier;
    last_id_ = record.last_id;
    bytes_ = 0;
    for (auto& [key, stack] : stacks_) {
        for (auto& step : stack.steps) {
            auto weighed = std::make_shared<Step>(*step);
            weighed->bytes = 0;
            weigh(*weighed);
            step = std::move(weighed);
        }
        keep_bounds(stack);
    }
    keep_load_bounds(scene);
}

void Undo::take_read(const std::shared_ptr<const LeftScene>& kept, std::shared_ptr<const LeftScene> read,
                     const Scene& scene) {
    const auto at = std::ranges::find(earlier_, kept);
    if (at == earlier_.end()) return;  // it was dropped meanwhile
    if (read)
        *at = std::move(read);
    else
        earlier_.erase(earlier_.begin(), at + 1);
    keep_load_bounds(scene);
}

std::vector<std::pair<std::uint32_t, v1::UndoState>> Undo::take_news() {
    std::vector<std::pair<std::uint32_t, v1::UndoState>> news;
    for (auto& [session, one] : sessions_) {
        if (!one.wants) continue;
        const Stack* stack = stack_of(session);
        v1::UndoState now;
        if (stack != nullptr && stack->done > 0)
            now.set_undo_label(stack->steps[stack->done - 1]->label);
        else if (const Left* left = left_by(session, earlier_))
            now.set_undo_label(left->label);
        if (stack != nullptr && stack->done < stack->steps.size())
            now.set_redo_label(stack->steps[stack->done]->label);
        else if (const Left* left = left_by(session, later_))
            now.set_redo_label(left->label);
        if (now.undo_label() == one.told.undo_label() && now.redo_label() == one.told.redo_label()) continue;
        one.told = now;
        news.emplace_back(session, std::move(now));
    }
    return news;
}

}  // namespace gonio
