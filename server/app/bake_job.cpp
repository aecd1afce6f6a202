#include "server/app/bake_job.h"

#include <unistd.h>

#include <cstdio>
#include <iomanip>
#include <mutex>
#include <sstream>
#include <stop_token>

#include "server/app/stop_on_signal.h"
#include "server/bake/output.h"
#include "server/base/clock.h"
#include "server/base/print_refusal.h"
#include "server/scene/scene.h"
#include "server/sequence/job_json.h"
#include "server/sequence/timeline.h"
#include "server/session/scene_access.h"
#include "server/trace/geometry.h"

namespace gonio {
namespace {

// A line on stderr, written over where that is a terminal: what is computed, how far it is, how long it takes yet.
class ProgressLine {
public:
    void begin(const std::string& what) {
        what_ = what;
        begin_ns_ = told_ns_ = monotonic_ns();
        std::fprintf(stderr, terminal_ ? "\r\033[K%s" : "%s\n", what.c_str());
        std::fflush(stderr);
    }
    // Any thread, one at a time.
    void tell(double share) {
        const std::int64_t now = monotonic_ns();
        if (seconds_between(told_ns_, now) < (terminal_ ? 0.5 : 10.0) || share <= 0.0) return;
        told_ns_ = now;
        const double left = seconds_between(begin_ns_, now) * (1.0 - share) / share;
        std::fprintf(stderr, terminal_ ? "\r\033[K%s: %.0f %%, %.0f s left" : "%s: %.0f %%, %.0f s left\n",
                     what_.c_str(), 100.0 * share, left);
        std::fflush(stderr);
    }
    void end() const {
        if (terminal_) std::fputs("\r\033[K", stderr);
    }

private:
    bool terminal_ = isatty(STDERR_FILENO) != 0;
    std::string what_;
    std::int64_t begin_ns_ = 0, told_ns_ = 0;
};

bake::BakeSettings settings_of(const BakeOptions& options) {
    bake::BakeSettings settings;
    settings.atlas.width = settings.atlas.height = options.size;
    settings.atlas.texel_m = options.texel_m;
    settings.atlas.second_uv = options.uv == "second";
    settings.directions = options.directions;
    settings.bounces = options.bounces;
    settings.tolerance = options.tolerance;
    settings.openings = options.openings == "on";
    settings.steps = options.steps;
    settings.even_steps = options.steps_form == "even";
    settings.air_rays = options.air == "rays";
    settings.seed = options.seed;
    settings.memory_bytes = std::size_t{options.memory_mib} << 20;
    return settings;
}

int refused(const std::string& place, const Error& error) {
    print_refusal(place, error);
    return 1;
}

// Of a text, parted by blanks; "a name" in double quotes is one.
std::vector<std::string> words_of(const std::string& text) {
    std::istringstream stream(text);
    std::vector<std::string> words;
    for (std::string word; stream >> std::quoted(word);) words.push_back(word);
    return words;
}

}  // namespace

int run_bake(const Options& options, Scene scene) {
    const SceneAccess access{true, {}, "", options.load, options.max_memory};
    try {
        for (const std::string& text : options.bake.set)
            sequence::apply_words(scene, words_of(text), access, "--bake-set \"" + text + "\"");
    } catch (const job::Refused& no) {
        return refused(no.place, no.error);
    }
    std::stop_source stop;
    const StopOnSignal signals(stop);
    ProgressLine line;
    std::mutex telling;
    bake::Work work;
    work.stop = stop.get_token();
    work.progress = [&](double share) {
        const std::unique_lock lock(telling, std::try_to_lock);
        if (lock) line.tell(share);
    };
    line.begin("charts and texels");
    const auto geometry = trace::geometry_of(scene);
    const auto summary = bake::bake_to_folder(
        scene, *geometry, settings_of(options.bake), {options.out, options.bake.format == "half", true},
        [&](const std::string& what, int, int) { line.begin(what); }, work);
    line.end();
    if (!summary) return refused("--bake " + options.bake.scene, summary.error());
    std::printf(
        "%s %dx%d charts %zu texels %zu mean %.4g lx error %.2g lx rays %llu in %.1f s, %d parts computed, %d taken "
        "over\n",
        options.out.c_str(), summary->width, summary->height, summary->charts, summary->texels, summary->mean_lx,
        summary->error_lx, static_cast<unsigned long long>(work.rays.load()), summary->seconds, summary->computed,
        summary->taken_over);
    return 0;
}

}  // namespace gonio
