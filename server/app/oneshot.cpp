#include "server/app/oneshot.h"

#include <cstdio>
#include <filesystem>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>

#include "protocol/schema/measure.pb.h"
#include "protocol/schema/words.h"
#include "server/app/stop_on_signal.h"
#include "server/base/atomic_file.h"
#include "server/base/print_refusal.h"
#include "server/lighting/isa.h"
#include "server/sequence/frame_picture.h"
#include "server/sequence/sequence_job.h"
#include "server/sequence/timeline.h"
#include "server/session/capture_file.h"
#include "server/session/legend.h"
#include "server/session/query.h"
#include "server/session/traced_capture.h"

namespace gonio {
namespace {

using job::item;
using job::Json;
using job::refuse;
using job::Refused;

constexpr int kFrameRefused = 1;  // of a list of frames

int told(const std::string& place, const Error& error, int exit_code) {
    print_refusal(place, error);
    return exit_code;
}

// What is to be said of a picture's noise, empty for nothing.
std::string note_of(const std::optional<trace::Progress>& traced) {
    if (!traced) return "";
    if (traced->passes < trace::kLeastPassesOfNoise)
        return " noise not known: of " + std::to_string(traced->passes) + " samples, fewer than 8";
    return traced->noise_reached ? "" : " noise " + print_number(traced->noise) + ", more than was asked for";
}

// What a job's list of frames is carried out with.
struct Job {
    const sequence::RunOptions& options;
    const SceneAccess& access;
    const std::stop_token& stop;
    ExrHeader header;
    sequence::Renderers renderers{options.renderer, nullptr};
};

// Result: false after a stop.
bool write_capture(Job& job, const Scene& scene, const Json& capture, const std::string& place) {
    const std::string name = job::text_at(capture, "out", place, "");
    const std::filesystem::path relative(name);
    if (name.empty() || relative.is_absolute() || relative.lexically_normal().begin()->string() == "..")
        refuse(place + ".out", name, "must name a file inside the output folder");
    const auto format = capture_format(name);
    if (!format) refuse(place + ".out", name, "must end in .png, .jpg or .exr");
    const v1::CaptureQuery query = sequence::query_of(capture, *format, place);
    const CaptureRequest request = job::checked(place, check_capture(scene, query));
    auto taken = sequence::take_picture(job.renderers, scene, request, job.stop);
    if (!taken) return false;
    if (request.legend) draw_legend(taken->picture, scene, request.view);
    const std::vector<std::byte> bytes =
        job::checked(place, encode_capture(taken->picture, request.view, request.format, job.header));
    const std::filesystem::path path = std::filesystem::path(job.options.out) / relative;
    std::error_code failed;
    std::filesystem::create_directories(path.parent_path(), failed);
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (const auto wrote = write_file_atomically(path.string(), text); !wrote)
        refuse(place + ".out", path.string(), "the file cannot be written: " + wrote.error().message);
    std::printf("%s %dx%d %s%s\n", path.string().c_str(), request.width_px, request.height_px, view_name(request.view),
                note_of(taken->traced).c_str());
    std::fflush(stdout);
    return true;
}

// The job's list of captures, each after its commands. Result: the exit code.
int run_frames(const Json& frames, Scene scene, Job job) {
    if (!frames.is_array()) refuse("frames", frames, "the job must hold a list of frames");
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const Json& frame = frames[i];
        const std::string place = item("frames", i);
        if (!frame.is_object()) refuse(place, frame, "must be an object");
        if (frame.contains("set")) {
            if (!frame["set"].is_array()) refuse(place + ".set", frame["set"], "must be a list of commands");
            for (std::size_t k = 0; k < frame["set"].size(); ++k) {
                const std::string at = item(place + ".set", k);
                sequence::apply_words(scene, job::words_of(frame["set"][k], at), job.access, at);
            }
        }
        if (!frame.contains("capture") || !job.options.shard.has(static_cast<int>(i))) continue;
        if (job.stop.stop_requested() || !write_capture(job, scene, frame["capture"], place + ".capture"))
            return told("signal", {"cancelled", "", "", "The job was stopped."}, sequence::kTryAgain);
    }
    return sequence::kDone;
}

}  // namespace

int run_oneshot(Scene scene, const std::string& job_file, const SceneAccess& access,
                const sequence::RunOptions& options) {
    std::stop_source source;
    const StopOnSignal signals(source);
    const std::stop_token stop = source.get_token();
    bool frames = false;
    try {
        const Json job = job::read_job(job_file);
        frames = job.contains("frames");
        if (frames == job.contains("sequence"))
            refuse(job_file, "", "the job must hold either a list of frames or a sequence");
        if (frames) {
            ExrHeader header;
            header.date = sequence::exr_date_of(job, "job");  // never the clock's, so that bytes repeat
            return run_frames(job["frames"], std::move(scene), {options, access, stop, header});
        }
        job::expect_object(job, "job", {"sequence"});
        return sequence::run_sequence(sequence::sequence_of(job["sequence"]), scene, access, options, stop);
    } catch (const Refused& refused) {
        return told(refused.place, refused.error, frames ? kFrameRefused : sequence::kBadJob);
    } catch (const std::bad_alloc&) {
        return told("memory", {"resource_exhausted", "", "", "There is not enough memory."}, sequence::kTryAgain);
    }
}

}  // namespace gonio
