#include "protocol/schema/words.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

namespace gonio {
namespace {

constexpr std::size_t kMaxProfileBytes = 1u << 20;
constexpr std::size_t kMaxVectorNumbers = 16;

Error usage(std::string where, std::string value, std::string message) {
    return {"usage", std::move(where), std::move(value), std::move(message)};
}

using Words = std::span<const std::string>;

// Setters: each reads one value into one field.
template <typename Set>
auto number_option(Set set, double factor = 1.0) {
    return [set, factor](const std::string& text) {
        const auto number = parse_number(text);
        if (number) set(*number * factor);
        return number.has_value();
    };
}
template <typename Set>
auto count_option(Set set) {
    return [set](const std::string& text) {
        const auto count = parse_count(text);
        if (count) set(*count);
        return count.has_value();
    };
}
auto vector_option(google::protobuf::RepeatedField<double>* field) {
    return [field](const std::string& text) {
        const auto numbers = parse_vector(text);
        if (numbers) field->Assign(numbers->begin(), numbers->end());
        return numbers.has_value();
    };
}
template <typename Set>
auto text_option(Set set) {
    return [set](const std::string& text) {
        set(text);
        return true;
    };
}

template <typename Set>
auto size_option(Set set) {
    return [set](const std::string& text) {
        const auto size = parse_size(text);
        if (size) set(size->first, size->second);
        return size.has_value();
    };
}

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

Result<bool> read_light(Words words, v1::SetLight& light) {
    const WordOption options[] = {
        {"--position", vector_option(light.mutable_position_m())},
        {"--aim", vector_option(light.mutable_aim())},
        {"--pan", number_option([&](double v) { light.set_pan_rad(v); }, kRadPerDeg)},
        {"--tilt", number_option([&](double v) { light.set_tilt_rad(v); }, kRadPerDeg)},
        {"--roll", number_option([&](double v) { light.set_roll_rad(v); }, kRadPerDeg)},
        {"--level", number_option([&](double v) { light.set_level_ratio(v); })},
        {"--color", vector_option(light.mutable_color_rgb())},
        {"--profile", text_option([&](const std::string& v) { light.mutable_profile()->set_name(v); })},
    };
    const auto names = parse_words(words, options, 1, 1);
    if (!names) return names.error();
    light.set_name(names->front());
    return true;
}

Result<bool> read_camera(Words words, v1::SetCamera& camera) {
    const WordOption options[] = {
        {"--eye", vector_option(camera.mutable_eye_m())},
        {"--target", vector_option(camera.mutable_target_m())},
        {"--fov", number_option([&](double v) { camera.set_fov_rad(v); }, kRadPerDeg)},
    };
    const auto none = parse_words(words, options, 0, 0);
    if (!none) return none.error();
    return true;
}

Result<bool> read_technique(Words words, v1::SetTechnique& technique) {
    const WordOption options[] = {
        {"--samples", count_option([&](std::uint32_t v) { technique.set_samples(v); })},
    };
    const auto names = parse_words(words, options, 1, 1);
    if (!names) return names.error();
    technique.set_technique(names->front());
    return true;
}

Result<bool> read_view(Words words, v1::SetView& view) {
    const WordOption options[] = {
        {"--gain", number_option([&](double v) { view.set_gain(v); })},
        {"--light", text_option([&](const std::string& v) { view.set_light(v); })},
    };
    const auto names = parse_words(words, options, 1, 1);
    if (!names) return names.error();
    view.set_view(names->front());
    return true;
}

// Result: the one number that the command takes.
Result<double> read_number(Words words, const std::string& what) {
    const auto values = parse_words(words, {}, 1, 1);
    if (!values) return values.error();
    const auto number = parse_number(values->front());
    if (!number) return usage(what, values->front(), "This is not a number.");
    return *number;
}

Result<bool> read_set(Words words, v1::Command& command) {
    if (words.empty())
        return usage("set", "", "What is to be set? technique, view, exposure, master, light, camera or size.");
    const std::string& what = words.front();
    const Words rest = words.subspan(1);
    if (what == "light") return read_light(rest, *command.mutable_set_light());
    if (what == "camera") return read_camera(rest, *command.mutable_set_camera());
    if (what == "technique") return read_technique(rest, *command.mutable_set_technique());
    if (what == "view") return read_view(rest, *command.mutable_set_view());
    if (what == "exposure" || what == "master") {
        const auto number = read_number(rest, what);
        if (!number) return number.error();
        if (what == "exposure") command.mutable_set_exposure()->set_ev100(*number);
        if (what == "master") command.mutable_set_master()->set_ratio(*number);
        return true;
    }
    if (what == "size") {
        const auto values = parse_words(rest, {}, 1, 1);
        if (!values) return values.error();
        const auto size = parse_size(values->front());
        if (!size) return usage("size", values->front(), "A size is written like 800x600.");
        command.mutable_set_size()->set_width_px(size->first);
        command.mutable_set_size()->set_height_px(size->second);
        return true;
    }
    return usage("set", what, "Only technique, view, exposure, master, light, camera and size can be set.");
}

Result<bool> read_preset(Words words, v1::Command& command) {
    const std::string action = words.empty() ? "" : words.front();
    if (action != "save" && action != "recall" && action != "remove")
        return usage("preset", action, "A preset can be saved, recalled or removed: preset save NAME.");
    double fade_s = 0;
    const WordOption fade{"--fade", number_option([&](double v) { fade_s = v; })};
    const auto options = std::span(&fade, action == "recall" ? 1 : 0);
    const auto names = parse_words(words.subspan(1), options, 1, 1);
    if (!names) return names.error();
    if (action == "save") command.mutable_save_preset()->set_name(names->front());
    if (action == "remove") command.mutable_remove_preset()->set_name(names->front());
    if (action == "recall") {
        command.mutable_recall_preset()->set_name(names->front());
        command.mutable_recall_preset()->set_fade_s(fade_s);
    }
    return true;
}

Result<bool> read_command(Words words, v1::Command& command) {
    const std::string& verb = words.front();
    const Words rest = words.subspan(1);
    if (verb == "set") return read_set(rest, command);
    if (verb == "group") {
        const auto names = parse_words(rest, {}, 1, 4096);
        if (!names) return names.error();
        command.mutable_set_group()->set_name(names->front());
        for (std::size_t i = 1; i < names->size(); ++i) command.mutable_set_group()->add_lights((*names)[i]);
        return true;
    }
    if (verb == "preset") return read_preset(rest, command);
    if (verb == "load") {
        if (rest.empty() || rest.front() != "scene")
            return usage("load", rest.empty() ? "" : rest.front(), "Only a scene can be loaded: load scene FILE.");
        const auto files = parse_words(rest.subspan(1), {}, 1, 1);
        if (!files) return files.error();
        command.mutable_load_scene()->set_file(files->front());
        return true;
    }
    if (verb == "add" || verb == "remove") {
        if (rest.empty() || rest.front() != "light")
            return usage(verb, rest.empty() ? "" : rest.front(), "Only a light can be added or removed.");
        if (verb == "add") {
            auto read = read_light(rest.subspan(1), *command.mutable_add_light()->mutable_light());
            if (read && !command.add_light().light().has_profile())
                return usage("--profile", "", "A new light needs --profile.");
            return read;
        }
        const auto names = parse_words(rest.subspan(1), {}, 1, 1);
        if (!names) return names.error();
        command.mutable_remove_light()->set_name(names->front());
        return true;
    }
    return read_set(words, command);
}

}  // namespace

std::optional<double> parse_number(std::string_view text) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error == std::errc::result_out_of_range && end == text.data() + text.size())
        return text.starts_with('-') ? -HUGE_VAL : HUGE_VAL;  // 1e999: a number that the server refuses
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

std::optional<std::uint32_t> parse_count(std::string_view text) {
    std::uint32_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

std::optional<std::vector<double>> parse_vector(std::string_view text) {
    std::vector<double> numbers;
    for (;;) {
        const std::size_t comma = std::min(text.find(','), text.size());
        std::string_view part = text.substr(0, comma);
        while (part.starts_with(' ')) part.remove_prefix(1);
        while (part.ends_with(' ')) part.remove_suffix(1);
        const auto number = parse_number(part);
        if (!number || numbers.size() == kMaxVectorNumbers) return std::nullopt;
        numbers.push_back(*number);
        if (comma == text.size()) return numbers;
        text.remove_prefix(comma + 1);
    }
}

std::optional<std::pair<std::uint32_t, std::uint32_t>> parse_size(std::string_view text) {
    const std::size_t cross = text.find('x');
    if (cross == std::string_view::npos) return std::nullopt;
    const auto width = parse_count(text.substr(0, cross)), height = parse_count(text.substr(cross + 1));
    if (!width || !height) return std::nullopt;
    return std::pair{*width, *height};
}

Result<std::vector<std::string>> parse_words(Words words, std::span<const WordOption> options,
                                             std::size_t min_positional, std::size_t max_positional) {
    std::vector<std::string> positional;
    bool only_words = false;
    for (std::size_t i = 0; i < words.size(); ++i) {
        const std::string& word = words[i];
        if (only_words || !word.starts_with('-') || word == "-" || parse_number(word)) {
            positional.push_back(word);
            continue;
        }
        if (word == "--") {
            only_words = true;
            continue;
        }
        const std::size_t equals = word.find('=');
        const std::string name = word.substr(0, equals);
        const auto option = std::find_if(options.begin(), options.end(), [&](const auto& o) { return o.name == name; });
        if (option == options.end()) return usage(name, "", "There is no such option here.");
        if (option->flag) {
            if (equals != std::string::npos) return usage(name, word.substr(equals + 1), "This option has no value.");
            *option->flag = true;
            continue;
        }
        if (equals == std::string::npos && i + 1 == words.size()) return usage(name, "", "This option needs a value.");
        const std::string value = equals == std::string::npos ? words[++i] : word.substr(equals + 1);
        if (!option->set(value)) return usage(name, value, "The value of this option cannot be read.");
    }
    if (positional.size() < min_positional) return usage("", "", "Something is missing at the end of the command.");
    if (positional.size() > max_positional) return usage("", positional[max_positional], "This word is one too many.");
    return positional;
}

// --base-rev goes with every command. Result: whether it was there; then it is in the command and not in the words.
static Result<bool> take_base_rev(std::vector<std::string>& words, v1::Command& command) {
    constexpr std::string_view name = "--base-rev";
    const auto end = std::find(words.begin(), words.end(), "--");
    const auto at = std::find_if(words.begin(), end, [&](const std::string& word) {
        return word == name || word.starts_with(std::string(name) + "=");
    });
    if (at == end) return false;
    const bool joined = at->size() > name.size();
    const std::string text = joined ? at->substr(name.size() + 1) : at + 1 != words.end() ? *(at + 1) : "";
    const auto rev = parse_count(text);
    if (!rev) return usage(std::string(name), text, "The option needs the number of a revision.");
    command.set_base_rev(*rev);
    words.erase(at, at + (joined ? 1 : 2));
    return true;
}

Result<v1::Command> command_from_words(Words words) {
    if (words.empty()) return usage("", "", "There is no command.");
    v1::Command command;
    std::vector<std::string> rest(words.begin(), words.end());
    const auto based = take_base_rev(rest, command);
    if (!based) return based.error();
    if (const auto read = read_command(*based ? Words(rest) : words, command); !read) return read.error();
    return command;
}

Result<v1::MeterQuery> meter_from_words(Words words) {
    v1::MeterQuery query;
    bool openings = false;
    const WordOption options[] = {
        {"--point", vector_option(query.mutable_point_m())},
        {"--normal", vector_option(query.mutable_normal())},
        {"--quality", text_option([&](const std::string& v) { query.set_quality(v); })},
        {"--bounces", text_option([&](const std::string& v) { query.set_bounces(v); })},
        {"--noise", number_option([&](double v) { query.set_noise_ratio(v); })},
        {"--openings", {}, &openings},
        {"--u", vector_option(query.mutable_u_m())},
        {"--v", vector_option(query.mutable_v_m())},
        {"--count", size_option([&](std::uint32_t nu, std::uint32_t nv) {
             query.clear_count();
             query.add_count(nu);
             query.add_count(nv);
         })},
    };
    if (const auto none = parse_words(words, options, 0, 0); !none) return none.error();
    query.set_openings(openings);
    if (query.point_m_size() == 0 || query.normal_size() == 0)
        return usage(query.point_m_size() == 0 ? "--point" : "--normal", "", "A meter needs a point and a normal.");
    return query;
}

std::optional<std::string> capture_format(const std::string& file) {
    std::string extension = std::filesystem::path(file).extension().string();
    for (char& c : extension) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    if (extension == ".jpeg") extension = ".jpg";
    for (const char* known : {".png", ".jpg", ".exr"})
        if (extension == known) return extension.substr(1);
    return std::nullopt;
}

Result<CaptureWords> capture_from_words(Words words) {
    CaptureWords capture;
    v1::CaptureQuery& query = capture.query;
    bool openings = false;
    const WordOption options[] = {
        {"--view", text_option([&](const std::string& v) { query.set_view(v); })},
        {"--quality", text_option([&](const std::string& v) { query.set_quality(v); })},
        {"--bounces", text_option([&](const std::string& v) { query.set_bounces(v); })},
        {"--noise", number_option([&](double v) { query.set_noise_ratio(v); })},
        {"--openings", {}, &openings},
        {"--after-rev",
         [&](const std::string& text) {
             const auto rev = parse_count(text);
             query.set_after_rev(rev.value_or(0));
             return rev.has_value();
         }},
        {"--size", size_option([&](std::uint32_t width, std::uint32_t height) {
             query.set_width_px(width);
             query.set_height_px(height);
         })},
    };
    const auto files = parse_words(words, options, 1, 1);
    if (!files) return files.error();
    const auto format = capture_format(files->front());
    if (!format) return usage("capture", files->front(), "A capture is a .png, .jpg or .exr file.");
    query.set_format(*format);
    query.set_openings(openings);
    capture.file = files->front();
    return capture;
}

Result<bool> attach_profile_file(v1::Command& command) {
    v1::SetLight* light = command.has_set_light()   ? command.mutable_set_light()
                          : command.has_add_light() ? command.mutable_add_light()->mutable_light()
                                                    : nullptr;
    if (!light || !light->has_profile()) return false;
    const std::filesystem::path path(light->profile().name());
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error)) return false;
    std::ifstream file(path, std::ios::binary);
    std::string bytes(kMaxProfileBytes + 1, '\0');
    file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (file.bad() || !file.is_open())
        return Error{"file_unreadable", "--profile", path.string(), "The file cannot be read."};
    bytes.resize(static_cast<std::size_t>(file.gcount()));
    light->mutable_profile()->set_name(path.filename().string());
    *light->mutable_profile()->mutable_photometry() = std::move(bytes);
    return true;
}

}  // namespace gonio
