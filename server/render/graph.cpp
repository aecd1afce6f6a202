#include "server/render/graph.h"

#include <chrono>

namespace gonio {

void PassCache::forget_target(std::uint32_t target) {
    std::erase_if(entries_, [&](const auto& entry) { return entry.first.target == target; });
}

void PassCache::forget_light(std::uint32_t light) {
    std::erase_if(entries_, [&](const auto& entry) { return entry.first.light == light; });
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
            const auto read = pass_cache.entries_.find(slot);
            key.push_back(read != pass_cache.entries_.end() ? read->second.version : 0);
            old = old || result.contains(slot);
        }
        const auto own = pass_cache.entries_.find(pass.writes);
        if (old || own == pass_cache.entries_.end() || own->second.version == 0 || own->second.key != key)
            result.insert(pass.writes);
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
        if (pass.absent) {
            row.set_state("absent");
            continue;
        }
        if (!needed.contains(pass.writes)) {
            row.set_state("culled");
            continue;
        }
        std::vector<std::uint64_t> key = pass.key;
        for (const SlotRef& slot : pass.reads) key.push_back(pass_cache.entries_[slot].version);
        PassCache::Entry& entry = pass_cache.entries_[pass.writes];
        if (!pass.stale && entry.version > 0 && entry.key == key) {
            row.set_state("clean");
            continue;
        }
        const auto start = std::chrono::steady_clock::now();
        before(i);
        const PassRun run = pass.run();
        after(i);
        entry.key = std::move(key);
        entry.version = ++pass_cache.newest_version_;
        row.set_state("ran");
        row.set_faces(run.faces);
        row.set_draws(run.draws);
        row.set_cpu_ms(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    }
    return rows;
}

}  // namespace gonio
