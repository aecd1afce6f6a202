#include "server/sequence/run.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <set>
#include <system_error>

#include "server/assets/exr.h"
#include "server/base/bounded_file.h"
#include "server/base/clock.h"
#include "server/base/sha256.h"
#include "server/scene/scene.h"
#include "server/sequence/digest.h"
#include "server/sequence/frame_picture.h"
#include "server/sequence/job_json.h"
#include "server/sequence/manifest.h"
#include "server/sequence/report.h"
#include "server/sequence/timeline.h"
#include "server/show/saved_show.h"
#include "server/stream/video_file.h"
#include "server/trace/geometry.h"

namespace gonio::sequence {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostPlaces = 4096;   // where light and eyes come by, that are looked at
constexpr int kProbes = 5, kProbe_px = 16;  // frames that are looked at for narrow beams, and their side
constexpr std::size_t kMaxFrameBytes = std::size_t{256} << 20;  // of a picture that goes into a video

// Where luminaires and eyes are in any frame, each some 1/50 of the scene apart.
class Places {
public:
    explicit Places(const SceneAsset& asset)
        : cell_m_(0.01 * std::max(1e-6, glm::length(asset.bounds.max - asset.bounds.min))) {}
    void add(const Scene& scene) {
        add(scene.camera.eye);
        if (scene.scene_rev == looked_at_) return;
        looked_at_ = scene.scene_rev;
        for (const Light& light : scene.lights)
            if (!light.sun) add(light.position);
    }
    std::vector<glm::dvec3> points;

private:
    void add(const glm::dvec3& point) {
        const glm::dvec3 cell = glm::floor(point / cell_m_);
        if (points.size() < kMostPlaces && seen_.emplace(cell.x, cell.y, cell.z).second) points.push_back(point);
    }
    double cell_m_;
    std::set<std::tuple<double, double, double>> seen_;
    Revision looked_at_ = 0;
};

struct Plan {
    std::vector<glm::dvec3> places;
    std::vector<Scene> probes;  // some frames, the first and the last among them
    std::string job;            // Maker::job
    int width_px = 0, height_px = 0;
};

// Goes through all frames. Throws job::Refused.
Plan plan_of(const Sequence& sequence, const Scene& scene, const SceneAccess& access, const RunOptions& options) {
    Timeline timeline(scene, sequence, access);
    ProfileTexts texts;
    const std::string begins = write_show(show_of(timeline.scene(), texts)),
                      asset = sha256_of_asset(*timeline.scene().asset);
    Places places(*timeline.scene().asset);
    Plan plan;
    for (int frame = 0; frame < sequence.frames; ++frame) {
        timeline.next();
        places.add(timeline.scene());
        const auto requests = requests_of(sequence, timeline.scene());
        if (!requests) job::refuse("sequence.capture at frame " + std::to_string(frame), requests.error());
        if (frame > 0) continue;
        plan.width_px = static_cast<int>(sequence.query.width_px());
        plan.height_px = static_cast<int>(sequence.query.height_px());
        if (plan.width_px == 0) plan.width_px = timeline.scene().width_px, plan.height_px = timeline.scene().height_px;
    }
    const bool odd = plan.width_px % 2 != 0 || plan.height_px % 2 != 0 || plan.width_px < 16 || plan.height_px < 16;
    if (!sequence.video.file.empty() && odd)
        job::refuse("sequence.capture.size", std::to_string(plan.width_px) + "x" + std::to_string(plan.height_px),
                    "must be even and at least 16 a side where there is a video");
    plan.places = std::move(places.points);
    std::string all = "gonio sequence 1";
    for (const std::string& part : {options.version, options.isa, options.settings, asset, sha256(begins),
                                    sha256(sequence.text), timeline.files()})
        all += "\n" + part;
    plan.job = sha256(all);
    return plan;
}

// Makes the renderer's pictures depend on the job alone.
void prepare(Renderer& renderer, const Plan& plan) {
    renderer.fix_transport(plan.places, false);
    for (const Scene& scene : plan.probes)
        if (scene.technique == Technique::standard)
            renderer.capture(scene, View::indirect, kProbe_px, kProbe_px, false);
    if (renderer.met_narrow_beams()) renderer.fix_transport(plan.places, true);
}

// Result: the exit code where the folder cannot be used.
std::optional<int> open_folder(const std::string& folder, std::string& why) {
    std::error_code failed;
    fs::create_directories(folder, failed);
    if (!failed && ::access(folder.c_str(), W_OK | X_OK) != 0) failed.assign(errno, std::generic_category());
    if (!failed) return std::nullopt;
    why = failed.message();
    const bool full = failed == std::errc::no_space_on_device || failed == std::errc::io_error ||
                      failed == std::errc::too_many_files_open || failed == std::errc::not_enough_memory;
    return full ? kTryAgain : kUsage;
}

class Run {
public:
    Run(const Sequence& sequence, const Scene& scene, const SceneAccess& access, const RunOptions& options,
        const std::stop_token& stop)
        : sequence_(sequence), scene_(scene), access_(access), options_(options), stop_(stop) {}

    int all() {
        const Plan plan = plan_of(sequence_, scene_, access_, options_);
        maker_ = {plan.job, options_.version, options_.isa_used, "", cpu_name()};
        std::string why;
        if (const auto code = open_folder(options_.out, why)) {
            Report(options_.json, 0, 0).refused("--out", {"file_unwritable", "", options_.out, why});
            return *code;
        }
        remove_left_parts(options_.out, frame_name(sequence_, 0));
        if (!sequence_.video.file.empty()) remove_left_parts(options_.out, sequence_.video.file);
        entries_.resize(static_cast<std::size_t>(sequence_.frames));
        int own = 0, kept = 0;
        for (int frame = 0; frame < sequence_.frames; ++frame) {
            if (!options_.shard.has(frame)) continue;
            ++own;
            auto& entry = entries_[static_cast<std::size_t>(frame)];
            entry = complete_entry(options_.out, frame_name(sequence_, frame), maker_);
            if (entry) ++kept;
        }
        Report report(options_.json, own, kept);
        report.begin(maker_, sequence_.frames);
        for (const auto& entry : entries_)
            if (entry) report.kept(*entry);
        int code = kept < own ? make_frames(plan, report) : kDone;
        if (code == kDone) code = complete(plan, report);
        report.end(code);
        return code;
    }

private:
    int refused(const Report& report, const std::string& place, const Error& error) const {
        report.refused(place, error);
        return kTryAgain;
    }
    int stopped(const Report& report) const {
        return refused(report, "signal", {"cancelled", "", "", "The run was stopped; the same command goes on."});
    }

    int make_frames(const Plan& plan, Report& report) {
        Timeline timeline(scene_, sequence_, access_);
        Renderers renderers{[&]() -> Renderer& {
                                Renderer& renderer = options_.renderer();
                                if (!std::exchange(ready_, true)) prepare(renderer, plan);
                                maker_.gl = options_.gl();
                                return renderer;
                            },
                            nullptr};
        for (int frame = 0; frame < sequence_.frames; ++frame) {
            timeline.next();
            auto& entry = entries_[static_cast<std::size_t>(frame)];
            if (!options_.shard.has(frame) || entry) continue;
            if (stop_.stop_requested()) return stopped(report);
            const std::int64_t began_ns = monotonic_ns();
            const std::string name = frame_name(sequence_, frame);
            const auto bytes = frame_bytes(renderers, timeline.scene(), sequence_, frame, stop_);
            if (!bytes) job::refuse(name, bytes.error());
            if (!*bytes) return stopped(report);
            const std::string_view text(reinterpret_cast<const char*>((*bytes)->data()), (*bytes)->size());
            entry = Entry{name, frame, sequence_.time_s(frame), timeline.scene().scene_rev, sha256(text), text.size(),
                          "",   maker_};
            auto wrote = write_file(options_.out, name, text);
            if (wrote) wrote = write_entry(options_.out, *entry);
            if (!wrote) return refused(report, name, wrote.error());
            report.written(*entry, seconds_since(began_ns));
        }
        return kDone;
    }

    // Once the frames of all shards are there: the manifest of all, and the video.
    int complete(const Plan& plan, const Report& report) {
        int missing = 0;
        for (int frame = 0; frame < sequence_.frames; ++frame)
            if (!entries_[static_cast<std::size_t>(frame)] && !seems_complete(frame)) ++missing;
        for (int frame = 0; frame < sequence_.frames && missing == 0; ++frame) {
            auto& entry = entries_[static_cast<std::size_t>(frame)];
            if (!entry) entry = complete_entry(options_.out, frame_name(sequence_, frame), maker_);
            if (!entry) ++missing;
        }
        if (missing > 0) {
            report.waiting(missing);
            return kDone;
        }
        std::vector<Entry> all;
        for (const auto& entry : entries_) all.push_back(*entry);
        if (!sequence_.video.file.empty()) {
            const int code = make_video(plan, report, all);
            if (code != kDone) return code;
        }
        const std::string text = manifest_text(all);
        const auto there = read_bounded_file((fs::path(options_.out) / kManifestFile).string(), text.size());
        if (there && *there == text) return kDone;
        if (auto wrote = write_file(options_.out, kManifestFile, text); !wrote)
            return refused(report, kManifestFile, wrote.error());
        return kDone;
    }

    // A quick look, without the bytes of the picture.
    bool seems_complete(int frame) const {
        const fs::path name = frame_name(sequence_, frame);
        std::error_code failed;
        return fs::exists(fs::path(options_.out) / name, failed) &&
               fs::exists(fs::path(options_.out) / kManifestFolder / (name.string() + ".json"), failed);
    }

    // Adds its entry to `all`, the frames'.
    int make_video(const Plan& plan, const Report& report, std::vector<Entry>& all) const {
        std::string hashes = "gonio video 2\n" + print_number(sequence_.video.crf);
        for (const Entry& entry : all) hashes += "\n" + entry.sha256;
        const std::string from = sha256(hashes), name = sequence_.video.file;
        if (auto there = complete_entry(options_.out, name, maker_); there && there->from == from) {
            report.video(*there, true);
            all.push_back(std::move(*there));
            return kDone;
        }
        const std::string path = (fs::path(options_.out) / name).string(), part = part_name(path);
        std::error_code failed;
        fs::create_directories(fs::path(path).parent_path(), failed);
        const VideoSettings settings{plan.width_px,
                                     plan.height_px,
                                     sequence_.frames,
                                     sequence_.fps.numerator,
                                     sequence_.fps.denominator,
                                     sequence_.video.crf,
                                     name.ends_with(".mkv")};
        const auto read = [&](std::int64_t frame) -> Result<std::vector<std::uint8_t>> {
            const std::string picture = (fs::path(options_.out) / all[static_cast<std::size_t>(frame)].name).string();
            const auto bytes = read_bounded_file(picture, kMaxFrameBytes);
            if (!bytes) return bytes.error();
            auto image = decode_picture(std::as_bytes(std::span(*bytes)), picture);
            if (!image) return image.error();
            return std::move(image->rgb);
        };
        if (auto made = write_video(part, settings, read, stop_); !made) {
            ::unlink(part.c_str());
            return made.error().code == "cancelled" ? stopped(report) : refused(report, name, made.error());
        }
        if (auto finished = finish_part(path); !finished) return refused(report, name, finished.error());
        const FileDigest digest = sha256_of_file(path);
        Entry entry{name, -1, 0.0, 0, digest.sha256, digest.bytes, from, maker_};
        entry.maker.gl.clear();
        if (auto wrote = write_entry(options_.out, entry); !wrote) return refused(report, name, wrote.error());
        report.video(entry, false);
        all.push_back(std::move(entry));
        return kDone;
    }

    const Sequence& sequence_;
    const Scene& scene_;
    const SceneAccess& access_;
    const RunOptions& options_;
    const std::stop_token& stop_;
    Maker maker_;
    bool ready_ = false;
    std::vector<std::optional<Entry>> entries_;  // by frame, as far as they are known to be complete
};

}  // namespace

int run_sequence(const Sequence& sequence, const Scene& scene, const SceneAccess& access, const RunOptions& options,
                 const std::stop_token& stop) {
    return Run(sequence, scene, access, options, stop).all();
}

}  // namespace gonio::sequence
