// The frame graph without GL: which passes run, and why the others do not. A pass reads slots, writes one slot, and
// runs only if something it reads moved. Reasons for skipping, in the report by name: absent (the scene lacks it; the
// pipeline lists it as such), culled (nobody wants the output), clean (same inputs as last time).
#pragma once

#include <compare>
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "protocol/schema/report.pb.h"

namespace gonio {

enum class Slot : std::uint8_t {
    gbuffer,
    grid,
    shadow,
    rsm,
    mask,
    flux,
    surfels,
    solve,
    weights,
    weights_gl,
    merged,
    merged_solve,
    emitted,
    direct,
    gather,
    gathered,
    besides,
    layers,
    picture,
    nv12,
    edges,
    distances,  // of haze, as those up to airlight
    haze_points,
    haze_surfels,
    probes,
    seen_probes,
    glow,
    air_view,
    airlight,
    openings,
    // Of no pass; PassCache::hold says what they were made from.
    reached,
    each_pixel,
    gathering,
    refined,
    edge_samples,
    grid_sum,
    air_picture
};

// A slot of the frame: per target (0: shared by all targets) and per light (0: shared by all lights).
struct SlotRef {
    Slot slot;
    std::uint32_t target = 0;
    std::uint32_t light = 0;
    auto operator<=>(const SlotRef&) const = default;
};

struct PassRun {
    unsigned faces = 0;  // cube faces rasterised
    unsigned draws = 0;
};

struct Pass {
    std::string name;
    std::string light;  // name; empty for shared passes
    std::vector<SlotRef> reads;
    SlotRef writes;
    std::vector<std::uint64_t> key;  // revisions and options that are read besides the slots
    bool stale = false;              // runs even if nothing moved: part of its output was never made
    bool absent = false;             // the scene has nothing for it; run is not called
    std::function<PassRun()> run;
    bool on_gpu = true;  // else all its time is cpu_ms
};

// What each slot was last made from. Lives as long as the slots do.
class PassCache {
public:
    // Forgets all slots of a target or of a light, whose textures are gone.
    void forget_target(std::uint32_t target);
    void forget_light(std::uint32_t light);

    // Result: another number with every change of the slot; 0: it holds nothing.
    std::uint64_t version(const SlotRef& slot) const;
    // What is made outside of passes, or is a part of a pass. Result: whether the slot was made from this key.
    bool holds(const SlotRef& slot, const std::vector<std::uint64_t>& key) const;
    // It is, from now on. failure: why its pass did not make it from this key, and left what was there; empty: it did.
    void hold(const SlotRef& slot, std::vector<std::uint64_t> key, std::string failure = {});
    // Result: of a slot that holds something, the failure that it was held with.
    const std::string& failure(const SlotRef& slot) const { return entries_.at(slot).failure; }

private:
    struct Entry {
        std::vector<std::uint64_t> key;
        std::uint64_t version = 0;
        std::string failure;
    };
    std::map<SlotRef, Entry> entries_;
    std::uint64_t newest_version_ = 0;  // never used twice: a slot made anew after forgetting is news to its readers
};

// Result: of the slots that `wanted` needs those whose passes would run.
std::set<SlotRef> outdated(std::span<const Pass> passes, std::span<const SlotRef> wanted, const PassCache& pass_cache);

// Runs the passes in the order given, each at most once. Every slot is written by at most one of the passes and read
// only by later ones. The wanted slots are those that somebody looks at. The calls before/after(i) surround each run
// (timers). A pass whose program does not link (gl::ProgramError) leaves its slot as it was. It is not tried again
// before what it reads changes, and the others run. Result: one row per pass, in order, cpu_ms filled.
std::vector<v1::PassReport> execute(
    std::span<Pass> passes, std::span<const SlotRef> wanted, PassCache& pass_cache,
    const std::function<void(std::size_t)>& before = [](std::size_t) {},
    const std::function<void(std::size_t)>& after = [](std::size_t) {});

// Result: why the first pass that failed did, after its name; empty: none failed.
std::string failure_of(const v1::FrameReport& report);

}  // namespace gonio
