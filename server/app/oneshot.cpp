#include "server/app/oneshot.h"

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "protocol/schema/words.h"
#include "server/base/bounded_file.h"
#include "server/session/capture_file.h"
#include "server/session/command_files.h"
#include "server/session/legend.h"
#include "server/session/query.h"
#include "server/session/traced_capture.h"
#include "server/trace/exposure.h"

namespace gonio {
namespace {

using Json = nlohmann::json;

// The job is somebody's file: every step that does not fit says where.
struct Refused {
    std::string place;
    Error error;
};

[[noreturn]] void refuse(const std::string& place, Error error) {
    throw Refused{place, std::move(error)};
}
[[noreturn]] void refuse(const std::string& place, const std::string& value, const std::string& message) {
    refuse(place, Error{"bad_job", "", value, message});
}

template <typename T>
T checked(const std::string& place, Result<T> result) {
    if (!result) refuse(place, result.error());
    return std::move(*result);
}

std::string text_at(const Json& object, const char* key, const std::string& place, const std::string& otherwise) {
    if (!object.contains(key)) return otherwise;
    if (!object[key].is_string() || object[key].get_ref<const std::string&>().empty()) {
        refuse(place + "." + key, object[key].dump(), "must be a string that is not empty");
    }
    return object[key];
}

void apply_words(Scene& scene, const Json& words, const SceneAccess& access, const std::string& place) {
    std::vector<std::string> list;
    if (!words.is_array()) refuse(place, words.dump(), "must be a list of words");
    for (const Json& word : words) {
        if (!word.is_string()) refuse(place, word.dump(), "must be a string");
        list.push_back(word);
    }
    v1::Command command = checked(place, command_from_words(list));
    checked(place, attach_profile_file(command));
    if (command.has_recall_preset()) command.mutable_recall_preset()->set_fade_s(0);  // a job has no time
    checked(place, apply(scene, command, checked(place, read_files(command, access))));
    if (!command.set_exposure().automatic()) return;
    if (const auto ev100 = trace::metered_ev100(scene)) {  // at once: a job has no rest
        command.mutable_set_exposure()->set_ev100(*ev100);
        checked(place, apply(scene, command, {}));
    }
}

std::optional<double> number_at(const Json& object, const char* key, const std::string& place) {
    if (!object.contains(key)) return std::nullopt;
    if (!object[key].is_number()) refuse(place + "." + key, object[key].dump(), "must be a number");
    return object[key].get<double>();
}

bool flag_at(const Json& object, const char* key, const std::string& place) {
    if (!object.contains(key)) return false;
    if (!object[key].is_boolean()) refuse(place + "." + key, object[key].dump(), "must be true or false");
    return object[key];
}

v1::CaptureQuery query_of(const Json& capture, const std::string& format, const std::string& place) {
    v1::CaptureQuery query;
    query.set_format(format);
    query.set_view(text_at(capture, "view", place, ""));
    query.set_quality(text_at(capture, "quality", place, ""));
    if (capture.contains("bounces")) {
        const Json& bounces = capture["bounces"];
        query.set_bounces(bounces.is_string() ? bounces.get<std::string>() : bounces.dump());
    }
    if (const auto noise = number_at(capture, "noise", place)) query.set_noise_ratio(*noise);
    if (const auto seconds = number_at(capture, "max_seconds", place)) query.set_max_seconds(*seconds);
    if (const auto samples = number_at(capture, "samples_per_pixel", place)) {
        if (!(*samples >= 1.0 && *samples <= kMostSamplesPerPixel && *samples == std::floor(*samples)))
            refuse(place + ".samples_per_pixel", capture["samples_per_pixel"].dump(),
                   "must be a whole number from 1 to 64");
        query.set_samples_per_pixel(static_cast<std::uint32_t>(*samples));
    }
    query.set_openings(flag_at(capture, "openings", place));
    query.set_denoise(flag_at(capture, "denoise", place));
    query.set_legend(flag_at(capture, "legend", place));
    if (const std::string size = text_at(capture, "size", place, ""); !size.empty()) {
        const auto parsed = parse_size(size);
        if (!parsed || parsed->first < 1 || parsed->second < 1) {
            refuse(place + ".size", size, "must be WIDTHxHEIGHT, 1 to 4096 a side");
        }
        query.set_width_px(parsed->first);
        query.set_height_px(parsed->second);
    }
    return query;
}

// Result: the picture. note: what is to be said of it, empty for nothing.
CapturedPicture render(Renderer& renderer, const Scene& scene, const CaptureRequest& request, std::string& note) {
    if (request.quality == Quality::reference) {
        TracedCapture traced =
            *trace_capture(trace::make_world(scene), scene, request, {}, [](const trace::Progress&) {});
        if (traced.progress.passes < trace::kLeastPassesOfNoise)
            note = " noise not known: of " + std::to_string(traced.progress.passes) + " samples, fewer than 8";
        else if (!traced.progress.noise_reached)
            note = " noise " + print_number(traced.progress.noise) + ", more than was asked for";
        return std::move(traced.picture);
    }
    return *renderer.capture(scene, request.view, request.width_px, request.height_px, request.format == "exr",
                             request.settings.bounces, request.samples_per_pixel);
}

void write_capture(Renderer& renderer, const Scene& scene, const Json& capture, const std::string& place,
                   const std::filesystem::path& folder) {
    const std::string name = text_at(capture, "out", place, "");
    const std::filesystem::path relative(name);
    if (name.empty() || relative.is_absolute() || relative.lexically_normal().begin()->string() == "..") {
        refuse(place + ".out", name, "must name a file inside the output folder");
    }
    const auto format = capture_format(name);
    if (!format) refuse(place + ".out", name, "must end in .png, .jpg or .exr");
    const v1::CaptureQuery query = query_of(capture, *format, place);
    const CaptureRequest request = checked(place, check_capture(scene, query));
    std::string note;
    CapturedPicture picture = render(renderer, scene, request, note);
    if (request.legend) draw_legend(picture, scene, request.view);
    const std::vector<std::byte> bytes = checked(place, encode_capture(picture, request.view, request.format));
    const std::filesystem::path path = folder / relative, part = path.string() + ".part";
    std::error_code failed;
    std::filesystem::create_directories(path.parent_path(), failed);
    std::ofstream file(part, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    file.close();
    if (!file) refuse(place + ".out", path.string(), "the file cannot be written");
    std::filesystem::rename(part, path, failed);
    if (failed) refuse(place + ".out", path.string(), "the file cannot be renamed: " + failed.message());
    std::printf("%s %dx%d %s%s\n", path.string().c_str(), request.width_px, request.height_px, view_name(request.view),
                note.c_str());
    std::fflush(stdout);
}

Json read_job(const std::string& job_file) {
    const auto text = read_bounded_file(job_file, kMaxJobBytes);
    if (!text) refuse(job_file, "", "the job " + text.error().message);
    if (text->size() > kMaxJobBytes) refuse(job_file, "", "a job may have at most 16 MiB");
    try {
        return Json::parse(*text);
    } catch (const Json::parse_error& error) {
        refuse(job_file, "byte " + std::to_string(error.byte), "the job is not JSON");
    }
}

}  // namespace

int run_oneshot(Renderer& renderer, Scene scene, const std::string& job_file, const std::string& out,
                const SceneAccess& access) {
    try {
        const Json job = read_job(job_file);
        if (!job.is_object() || !job.contains("frames") || !job["frames"].is_array())
            refuse("frames", "", "the job must hold a list of frames");
        for (std::size_t i = 0; i < job["frames"].size(); ++i) {
            const Json& frame = job["frames"][i];
            const std::string place = "frames[" + std::to_string(i) + "]";
            if (!frame.is_object()) refuse(place, frame.dump(), "must be an object");
            if (frame.contains("set")) {
                if (!frame["set"].is_array()) refuse(place + ".set", frame["set"].dump(), "must be a list of commands");
                for (std::size_t k = 0; k < frame["set"].size(); ++k)
                    apply_words(scene, frame["set"][k], access, place + ".set[" + std::to_string(k) + "]");
            }
            if (frame.contains("capture")) write_capture(renderer, scene, frame["capture"], place + ".capture", out);
        }
    } catch (const Refused& refused) {
        std::fprintf(stderr, "goniod: %s: %s: %s\n", refused.place.c_str(), refused.error.code.c_str(),
                     refused.error.text().c_str());
        return 1;
    }
    return 0;
}

}  // namespace gonio
