#include "server/render/graph.h"

#include <chrono>

#include "server/gl/program.h"

namespace gonio {

void PassCache::forget_target(std::uint32_t target) {
    std::erase_if(entries_, [&](const auto& entry) { return entry.first.target == target; });
}

void PassCache::forget_light(std::uint32_t light) {
    std::erase_if(entries_, [&](const auto& entry) { return entry.first.light == light; });
}

std::uint64_t PassCache::version(const SlotRef& slot) const {
    const auto entry = entries_.find(slot);
    return entry != entries_.end() ? entry->second.version : 0;
}

bool PassCache::holds(const SlotRef& slot, const std::vector<std::uint64_t>& key) const {
    const auto entry = entries_.find(slot);
    return entry != entries_.end() && entry->second.version > 0 && entry->second.key == key;
}

void PassCache::hold(const SlotRef& slot, std::vector<std::uint64_t> key, std::string failure) {
    entries_[slot] = {std::move(key), ++newest_version_, std::move(failure)};
}

namespace {

std::set<SlotRef> needed_for(std::span<const Pass> passes, std::span<const SlotRef> wanted) {
    std::set<SlotRef> needed(wanted.begin(), wanted.end());
    for (std::size_t i = passes.size(); i-- > 0;) {
        if (passes[i].absent || !needed.contains(passes[i].writes)) continue;
        needed.insert(passes[i].reads.begin(), passes[i].reads.end());
    }
    return needed;
}

}  // namespace

std::set<SlotRef> outdated(std::span<const Pass> passes, std::span<const SlotRef> wanted, const PassCache& pass_cache) {
    const std::set<SlotRef> needed = needed_for(passes, wanted);
    std::set<SlotRef> result;
    for (const Pass& pass : passes) {
        if (pass.absent || !needed.contains(pass.writes)) continue;
        bool old = pass.stale;
        std::vector<std::uint64_t> key = pass.key;
        for (const SlotRef& slot : pass.reads) {
            key.push_back(pass_cache.version(slot));
            old = old || result.contains(slot);
        }
        if (old || !pass_cache.holds(pass.writes, key)) result.insert(pass.writes);
    }
    return result;
}

std::vector<v1::PassReport> execute(std::span<Pass> passes, std::span<const SlotRef> wanted, PassCache& pass_cache,
                                    const std::function<void(std::size_t)>& before,
                                    const std::function<void(std::size_t)>& after) {
    const std::set<SlotRef> needed = needed_for(passes, wanted);
    std::vector<v1::PassReport> rows;
    rows.reserve(passes.size());
    for (std::size_t i = 0; i < passes.size(); ++i) {
        Pass& pass = passes[i];
        v1::PassReport& row = rows.emplace_back();
        row.set_name(pass.name);
        if (!pass.light.empty()) row.set_light(pass.light);
        if (pass.absent || !needed.contains(pass.writes)) {
            row.set_state(pass.absent ? "absent" : "culled");
            continue;
        }
        std::vector<std::uint64_t> key = pass.key;
        for (const SlotRef& slot : pass.reads) key.push_back(pass_cache.version(slot));
        if (!pass.stale && pass_cache.holds(pass.writes, key)) {
            const std::string& failure = pass_cache.failure(pass.writes);
            row.set_state(failure.empty() ? "clean" : "failed");
            if (!failure.empty()) row.set_failure(failure);
            continue;
        }
        const auto start = std::chrono::steady_clock::now();
        before(i);
        PassRun run;
        try {
            run = pass.run();
        } catch (const gl::ProgramError& error) {
            pass_cache.hold(pass.writes, std::move(key), error.what());
            row.set_state("failed");
            row.set_failure(error.what());
            continue;
        }
        after(i);
        pass_cache.hold(pass.writes, std::move(key));
        row.set_state("ran");
        row.set_faces(run.faces);
        row.set_draws(run.draws);
        row.set_cpu_ms(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    }
    return rows;
}

std::string failure_of(const v1::FrameReport& report) {
    for (const v1::PassReport& row : report.passes())
        if (!row.failure().empty()) return row.name() + ": " + row.failure();
    return {};
}

}  // namespace gonio
