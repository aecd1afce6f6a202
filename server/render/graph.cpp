#include "server/render/graph.h"

#include <chrono>
#include <set>

namespace gonio {

void Ledger::forget_target(std::uint32_t target) {
    std::erase_if(entries_, [&](const auto& entry) { return entry.first.target == target; });
}

void Ledger::forget_light(std::uint32_t light) {
    std::erase_if(entries_, [&](const auto& entry) { return entry.first.light == light; });
}

std::vector<v1::PassReport> execute(std::span<Pass> passes, std::span<const SlotRef> wanted, Ledger& ledger,
                                    const std::function<void(std::size_t)>& before,
                                    const std::function<void(std::size_t)>& after) {
    std::set<SlotRef> needed(wanted.begin(), wanted.end());
    for (std::size_t i = passes.size(); i-- > 0;) {
        if (passes[i].absent || !needed.contains(passes[i].writes)) continue;
        needed.insert(passes[i].reads.begin(), passes[i].reads.end());
    }
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
        for (const SlotRef& slot : pass.reads) key.push_back(ledger.entries_[slot].version);
        Ledger::Entry& entry = ledger.entries_[pass.writes];
        if (!pass.stale && entry.version > 0 && entry.key == key) {
            row.set_state("clean");
            continue;
        }
        const auto start = std::chrono::steady_clock::now();
        before(i);
        const PassRun run = pass.run();
        after(i);
        entry.key = std::move(key);
        entry.version = ++ledger.newest_version_;
        row.set_state("ran");
        row.set_faces(run.faces);
        row.set_draws(run.draws);
        row.set_cpu_ms(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    }
    return rows;
}

}  // namespace gonio
