#include "server/show/undo_file.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <string_view>
#include <utility>

#include "protocol/schema/undo_file.pb.h"
#include "server/base/bounded_file.h"
#include "server/base/sha256.h"
#include "server/scene/scene.h"
#include "server/show/undo_values.h"

namespace gonio {
namespace {

constexpr std::uint32_t kUndoVersion = 1;
constexpr std::string_view kHead = "gonio undo\n";  // then the hash of what follows it, and a line's end
constexpr std::size_t kHashBytes = 64;

void put_steps(const UndoSteps& steps, const Scene& scene, ProfileTexts& texts, saved::UndoSteps& out) {
    UndoValueWriter writer(scene, texts, out);
    for (const Light& light : scene.lights) {
        saved::UndoLight& kept = *out.add_lights();
        kept.set_id(light.id);
        kept.set_name(light.name);
    }
    out.set_next_light_id(scene.next_light_id);
    std::set<EditKey> known;
    for (const auto& [key, stack] : steps.stacks) {
        if (ends_with_session(key)) continue;
        saved::UndoStack& kept_stack = *out.add_stacks();
        kept_stack.set_key(key);
        kept_stack.set_done(static_cast<std::uint32_t>(stack.done));
        for (const auto& step : stack.steps) {
            saved::UndoStep& kept = *kept_stack.add_steps();
            kept.set_id(step->id);
            kept.set_label(step->label);
            for (const auto& [edit_key, edit] : step->edits) {
                known.insert(edit_key);
                saved::UndoEdit& kept_edit = *kept.add_edits();
                writer.put(edit_key, *kept_edit.mutable_key());
                writer.put(edit.before, *kept_edit.mutable_before());
                writer.put(edit.after, *kept_edit.mutable_after());
                kept_edit.set_before_writer(edit.before_writer);
                kept_edit.set_undone(edit.undone);
            }
        }
    }
    for (const auto& [key, of] : steps.writers) {
        if (!known.contains(key)) continue;
        saved::UndoWriter& kept = *out.add_writers();
        writer.put(key, *kept.mutable_key());
        kept.set_step(of.step);
        kept.set_input(of.input);
    }
}

// Result: without the oldest quarter of all steps, at least one.
UndoSteps without_oldest(UndoSteps steps) {
    std::vector<std::uint64_t> ids;
    for (const auto& [key, stack] : steps.stacks)
        for (const auto& step : stack.steps) ids.push_back(step->id);
    std::ranges::sort(ids);
    if (ids.empty()) return steps;
    const std::uint64_t last = ids[(ids.size() - 1) / 4];
    for (auto& [key, stack] : steps.stacks) {
        while (!stack.steps.empty() && stack.steps.front()->id <= last) {
            // What was undone can only be redone from its front.
            if (stack.done > 0) {
                stack.steps.pop_front();
                --stack.done;
            } else {
                stack.steps.clear();
            }
        }
    }
    return steps;
}

bool any_steps(const UndoSteps& steps) {
    return std::ranges::any_of(steps.stacks, [](const auto& stack) { return !stack.second.steps.empty(); });
}

// Result: nothing where a value of it cannot be read.
std::shared_ptr<const UndoStep> step_of(const saved::UndoStep& kept, const UndoValueReader& reader) {
    auto step = std::make_shared<UndoStep>();
    step->id = kept.id();
    step->label = kept.label();
    for (const saved::UndoEdit& edit : kept.edits()) {
        const auto key = reader.key(edit.key());
        if (!key) return nullptr;
        auto before = reader.value(*key, edit.before()), after = reader.value(*key, edit.after());
        if (!before || !after) return nullptr;
        step->edits[*key] = {std::move(*before), std::move(*after), edit.before_writer(), edit.undone()};
    }
    // A light has all of its properties while it is there.
    const auto is_there = [](const EditValue& value) {
        const auto* light = std::get_if<ExistingLight>(&value);
        return light != nullptr ? light->light != nullptr : !std::holds_alternative<std::monostate>(value);
    };
    for (const auto& [key, edit] : step->edits) {
        if (key.kind == EditKind::light || !is_of_light(key)) continue;
        const auto light = step->edits.find({EditKind::light, key.light, {}, {}});
        const bool before = light == step->edits.end() || is_there(light->second.before),
                   after = light == step->edits.end() || is_there(light->second.after);
        if (is_there(edit.before) != before || is_there(edit.after) != after) return nullptr;
    }
    return step;
}

UndoStack stack_of(const saved::UndoStack& kept, const UndoValueReader& reader) {
    UndoStack stack;
    for (int i = 0; i < kept.steps_size(); ++i) {
        auto step = step_of(kept.steps(i), reader);
        const bool undone = static_cast<std::uint32_t>(i) >= kept.done();
        if (!step && undone) break;
        if (!step) {
            stack = {};
            continue;
        }
        stack.steps.push_back(std::move(step));
        if (!undone) ++stack.done;
    }
    return stack;
}

Error unusable(const std::string& path, const char* why) {
    return {"bad_state", "", path, why};
}

Result<saved::UndoFile> read_one(const std::string& path, const std::string& state_sha256) {
    const auto text = read_bounded_file(path, 2 * kMaxUndoFileBytes);
    if (!text) return text.error();
    const std::string_view all = *text;
    const std::size_t body = kHead.size() + kHashBytes + 1;
    if (!all.starts_with(kHead) || all.size() < body || all[body - 1] != '\n' ||
        all.substr(kHead.size(), kHashBytes) != sha256(all.substr(body)))
        return unusable(path, "It is damaged.");
    saved::UndoFile file;
    if (!file.ParseFromArray(all.data() + body, static_cast<int>(all.size() - body)))
        return unusable(path, "It is damaged.");
    if (file.version() != kUndoVersion) return unusable(path, "It is of another version of the program.");
    if (file.state_sha256() != state_sha256) return unusable(path, "It belongs to another state.");
    return file;
}

}  // namespace

std::shared_ptr<const saved::UndoLeft> UndoFileWriter::kept_of(const std::shared_ptr<const LeftScene>& left,
                                                               const KeepFiles& keep_files) {
    if (left->kept) return left->kept;
    if (!left->scene) return nullptr;
    if (const auto made = lefts_.find(left); made != lefts_.end()) return made->second;
    if (refused_.contains(left)) return nullptr;
    auto kept = std::make_shared<saved::UndoLeft>();
    ProfileTexts texts;
    *kept->mutable_show() = show_of(*left->scene, texts);
    kept->set_key(left->key);
    kept->set_label(left->label);
    put_steps(left->steps, *left->scene, texts, *kept->mutable_steps());
    if (kept->ByteSizeLong() <= most_bytes_)
        return keep_files(*left->scene->asset, *kept->mutable_show()) ? kept : nullptr;
    refused_.insert(left);
    return nullptr;
}

std::string UndoFileWriter::write(const UndoRecord& record, const Scene& scene, const std::string& state_sha256,
                                  const KeepFiles& keep_files) {
    saved::UndoFile file;
    file.set_version(kUndoVersion);
    file.set_state_sha256(state_sha256);
    file.set_last_id(record.last_id);
    UndoSteps steps = record.steps;
    put_steps(steps, scene, texts_, *file.mutable_steps());
    while (file.ByteSizeLong() > most_bytes_ && any_steps(steps)) {
        steps = without_oldest(std::move(steps));
        file.clear_steps();
        put_steps(steps, scene, texts_, *file.mutable_steps());
    }
    texts_.forget_unused();
    std::map<std::shared_ptr<const LeftScene>, std::shared_ptr<const saved::UndoLeft>> lefts;
    std::vector<std::shared_ptr<const saved::UndoLeft>> earlier;
    std::size_t bytes = file.ByteSizeLong();
    for (auto left = record.earlier.rbegin(); left != record.earlier.rend(); ++left) {
        const auto kept = kept_of(*left, keep_files);
        if (!kept || (bytes += kept->ByteSizeLong()) > most_bytes_) break;
        lefts[*left] = kept;
        earlier.push_back(kept);
    }
    std::ranges::reverse(earlier);
    for (const auto& kept : earlier) *file.add_earlier() = *kept;
    lefts_ = std::move(lefts);
    std::erase_if(refused_,
                  [&](const auto& left) { return std::ranges::find(record.earlier, left) == record.earlier.end(); });
    const std::string body = file.SerializeAsString();
    return std::string(kHead) + sha256(body) + "\n" + body;
}

std::vector<std::shared_ptr<const saved::UndoLeft>> UndoFileWriter::lefts() const {
    std::vector<std::shared_ptr<const saved::UndoLeft>> lefts;
    for (const auto& [left, kept] : lefts_) lefts.push_back(kept);
    return lefts;
}

Result<saved::UndoFile> read_undo_file(const std::string& path, const std::string& state_sha256) {
    auto file = read_one(path + kUndoEnding, state_sha256);
    if (file) return file;
    auto next = read_one(path + kUndoNextEnding, state_sha256);
    if (!next) return file;
    std::error_code failed;  // the next save writes the other name anew, before the state
    std::filesystem::rename(path + kUndoNextEnding, path + kUndoEnding, failed);
    return next;
}

bool renew_ids(const saved::UndoSteps& steps, Scene& scene) {
    std::map<std::string, std::uint32_t> ids;
    std::set<std::uint32_t> taken;
    for (const saved::UndoLight& light : steps.lights()) {
        const bool fits = light.id() != 0 && light.id() < steps.next_light_id();
        if (!fits || !taken.insert(light.id()).second || !ids.emplace(light.name(), light.id()).second) return false;
    }
    for (const Light& light : scene.lights)
        if (!ids.contains(light.name)) return false;
    for (Light& light : scene.lights) light.id = ids.at(light.name);
    std::ranges::sort(scene.lights, {}, &Light::id);
    scene.next_light_id = steps.next_light_id();
    return true;
}

UndoSteps steps_of(const saved::UndoSteps& kept, const Scene& scene, std::uint64_t& last_id) {
    UndoSteps steps;
    const UndoValueReader reader(kept, scene);
    for (const saved::UndoStack& stack : kept.stacks()) {
        UndoStack read = stack_of(stack, reader);
        read.used = ++last_id;
        if (!read.steps.empty()) steps.stacks[stack.key()] = std::move(read);
    }
    for (const auto& [name, stack] : steps.stacks)
        for (const auto& step : stack.steps)
            for (const auto& [key, edit] : step->edits) ++steps.writers[key].uses;
    for (const saved::UndoWriter& writer : kept.writers()) {
        const auto key = reader.key(writer.key());
        const auto at = key ? steps.writers.find(*key) : steps.writers.end();
        if (at == steps.writers.end()) continue;
        at->second.step = writer.step();
        at->second.input = writer.input();
    }
    for (auto& [key, writer] : steps.writers) writer.now = value_of(scene, key);
    return steps;
}

UndoRecord record_of(const saved::UndoFile& file, const Scene& scene) {
    UndoRecord record;
    record.last_id = file.last_id();
    record.steps = steps_of(file.steps(), scene, record.last_id);
    for (const saved::UndoLeft& kept : file.earlier()) {
        LeftScene left;
        left.key = kept.key();
        left.label = kept.label();
        left.kept = std::make_shared<const saved::UndoLeft>(kept);
        record.earlier.push_back(std::make_shared<const LeftScene>(std::move(left)));
    }
    return record;
}

}  // namespace gonio
