// The frame graph without GL: what runs, what is clean, what is culled.
#include "server/render/graph.h"

#include <gtest/gtest.h>

#include "server/gl/program.h"

namespace gonio {
namespace {

struct Graph {
    PassCache pass_cache;
    std::uint64_t a_rev = 1, b_rev = 1;
    bool with_absent = false, links = true;
    std::string order;

    std::vector<Pass> passes() {
        std::vector<Pass> passes(3);
        passes[0] = {"a", "", {}, {Slot::gbuffer}, {a_rev}, false, false, [&] {
                         order += "a";
                         return PassRun{};
                     }};
        passes[1] = {"b", "lamp", {}, {Slot::shadow, 0, 7}, {b_rev}, false, false, [&] {
                         order += "b";
                         if (!links) throw gl::ProgramError("b.frag does not link");
                         return PassRun{2, 3};
                     }};
        passes[2] = {"c", "", {{Slot::gbuffer}, {Slot::shadow, 0, 7}}, {Slot::picture}, {}, false, false, [&] {
                         order += "c";
                         return PassRun{};
                     }};
        return passes;
    }
    std::string run(std::vector<SlotRef> wanted) {
        order.clear();
        std::string states;
        std::vector<Pass> all = passes();
        for (const v1::PassReport& row : execute(
                 all, wanted, pass_cache, [](std::size_t) {}, [](std::size_t) {}))
            states += row.state().substr(0, 2) + " ";
        return states;
    }
};

const SlotRef kPicture{Slot::picture}, kGbuffer{Slot::gbuffer};

TEST(Graph, RunsOnceThenIsClean) {
    Graph g;
    EXPECT_EQ(g.run({kPicture}), "ra ra ra ");
    EXPECT_EQ(g.order, "abc");
    EXPECT_EQ(g.run({kPicture}), "cl cl cl ");
}

TEST(Graph, AMovedInputRunsItsReadersOnly) {
    Graph g;
    g.run({kPicture});
    g.b_rev = 2;
    EXPECT_EQ(g.run({kPicture}), "cl ra ra ");
}

// A pass that fails leaves what it made, the others run; it is tried again when what it reads is another.
TEST(Graph, AFailureStaysUntilSomethingChanges) {
    Graph g;
    g.links = false;
    EXPECT_EQ(g.run({kPicture}), "ra fa ra ");
    EXPECT_EQ(g.pass_cache.failure({Slot::shadow, 0, 7}), "b.frag does not link");
    EXPECT_EQ(g.run({kPicture}), "cl fa cl ");
    EXPECT_EQ(g.order, "");
    std::vector<Pass> all = g.passes();
    EXPECT_TRUE(outdated(all, std::vector<SlotRef>{kPicture}, g.pass_cache).empty());
    v1::FrameReport report;
    for (v1::PassReport& row : execute(all, std::vector<SlotRef>{kPicture}, g.pass_cache))
        *report.add_passes() = std::move(row);
    EXPECT_EQ(failure_of(report), "b: b.frag does not link");
    g.links = true, g.b_rev = 2;
    EXPECT_EQ(g.run({kPicture}), "cl ra ra ");
    EXPECT_EQ(g.run({kPicture}), "cl cl cl ");
}

TEST(Graph, UnwantedIsCulledAndCatchesUpLater) {
    Graph g;
    g.run({kPicture});
    g.b_rev = 2;
    EXPECT_EQ(g.run({kGbuffer}), "cl cu cu ");
    EXPECT_EQ(g.run({kPicture}), "cl ra ra ");
    EXPECT_EQ(g.run({}), "cu cu cu ");
}

// What would run is what runs, without running it.
TEST(Graph, OutdatedSlotsAreThoseThatRunNext) {
    Graph g;
    const SlotRef wanted[] = {kPicture}, lamp{Slot::shadow, 0, 7};
    using Slots = std::set<SlotRef>;
    EXPECT_EQ(outdated(g.passes(), wanted, g.pass_cache), (Slots{kGbuffer, lamp, kPicture}));
    g.run({kPicture});
    EXPECT_EQ(outdated(g.passes(), wanted, g.pass_cache), Slots{});
    g.b_rev = 2;
    EXPECT_EQ(outdated(g.passes(), wanted, g.pass_cache), (Slots{lamp, kPicture}));
    const SlotRef gbuffer[] = {kGbuffer};
    EXPECT_EQ(outdated(g.passes(), gbuffer, g.pass_cache), Slots{}) << "nobody wants the rest";
    EXPECT_EQ(g.run({kPicture}), "cl ra ra ");
    EXPECT_EQ(outdated(g.passes(), wanted, g.pass_cache), Slots{});
}

TEST(Graph, ForgottenSlotsRunAgain) {
    Graph g;
    g.run({kPicture});
    g.pass_cache.forget_light(7);
    EXPECT_EQ(g.run({kPicture}), "cl ra ra ");
}

TEST(Graph, ASlotOfNoPassHoldsWhatItWasMadeFrom) {
    PassCache cache;
    const SlotRef sum{Slot::grid_sum, 3};
    EXPECT_EQ(cache.version(sum), 0u);
    EXPECT_FALSE(cache.holds(sum, {}));
    cache.hold(sum, {1, 2});
    const std::uint64_t before = cache.version(sum);
    EXPECT_TRUE(cache.holds(sum, {1, 2}));
    EXPECT_FALSE(cache.holds(sum, {1, 3}));
    cache.hold(sum, {1, 2});
    EXPECT_GT(cache.version(sum), before) << "made anew, it is news to its readers";
    cache.forget_target(3);
    EXPECT_FALSE(cache.holds(sum, {1, 2}));
}

}  // namespace
}  // namespace gonio
