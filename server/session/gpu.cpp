#include "server/session/gpu.h"

#include <charconv>
#include <stdexcept>

#include <spdlog/spdlog.h>

namespace gonio {

void add_fault(GpuFaults& faults, const std::string& spec) {
    struct Row {
        const char* name;
        unsigned GpuFaults::*count;
    };
    constexpr Row rows[] = {{"gl-loss-after", &GpuFaults::loss_after},
                            {"gl-loss-every", &GpuFaults::loss_every},
                            {"gl-rebuild-fails", &GpuFaults::rebuild_fails}};
    const std::size_t equals = spec.find('=');
    for (const Row& row : rows) {
        if (equals == std::string::npos || spec.substr(0, equals) != row.name) continue;
        const char* const end = spec.data() + spec.size();
        const auto [read, error] = std::from_chars(spec.data() + equals + 1, end, faults.*row.count);
        if (error == std::errc() && read == end) return;
    }
    throw std::invalid_argument("there is no fault '" + spec + "' to inject");
}

Gpu::Gpu(std::function<Made()> make, const GpuFaults& faults)
    : make_(std::move(make)), faults_(faults), made_(make_()) {}

bool Gpu::lost() const {
    const unsigned after = faults_.loss_every > 0 ? faults_.loss_every : rebuilt_ ? 0 : faults_.loss_after;
    if (after > 0 && pictures_ >= after) return true;
    return made_.context && made_.context->lost();
}

void Gpu::picture_done() {
    ++pictures_;
}

void Gpu::note_failure(const std::string& why) {
    const std::int64_t now_ns = monotonic_ns();
    failures_ns_.push_back(now_ns);
    while (failures_ns_.front() < now_ns - kRebuildWindowNs) failures_ns_.pop_front();
    spdlog::error("gpu: {}", why);
    if (failures_ns_.size() >= kMostFailedRebuilds) {
        throw std::runtime_error("the GPU was lost, and " + std::to_string(failures_ns_.size()) +
                                 " attempts within a minute to begin anew failed: " + why);
    }
}

std::unique_ptr<LiveRenderer> Gpu::rebuild(const std::function<bool()>& pause, bool lost) {
    if (lost && rebuilt_ && pictures_ == 0) note_failure("the new GL context was lost before its first picture");
    made_.context.reset();
    for (;;) {
        try {
            if (faults_.rebuild_fails > 0) {
                --faults_.rebuild_fails;
                throw std::runtime_error("injected");
            }
            made_ = make_();
            rebuilt_ = true;
            pictures_ = 0;
            return take_renderer();
        } catch (const std::runtime_error& error) {
            note_failure(error.what());
        }
        if (!pause()) return nullptr;
    }
}

}  // namespace gonio
