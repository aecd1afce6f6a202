// The source table as `gonio sources` prints it.
#include <gtest/gtest.h>

#include "client/cli/output.h"
#include "protocol/schema/console.pb.h"

namespace gonio {
namespace {

TEST(CliConsoles, SaysWhoSendsWhatAndWhoWins) {
    v1::Sources sources;
    v1::InputEndpoint& endpoint = *sources.add_endpoints();
    endpoint.set_protocol("sacn");
    endpoint.set_address("0.0.0.0:5568");
    endpoint.set_packets(88);
    endpoint.set_last_error("the priority is over 200 (byte 108: 201)");
    for (const unsigned universe : {1u, 2u, 3u, 7u}) endpoint.add_universes(universe);
    v1::SourceRow& row = *sources.add_sources();
    row.set_protocol("sacn");
    row.set_universe(3);
    row.set_name("front desk");
    row.set_address("10.0.0.7:5568");
    row.set_priority(150);
    row.set_rate_hz(43.96);
    row.set_lost(2);
    row.set_state("live");
    row.set_winning_slots(512);
    for (unsigned level = 0; level < 20; ++level) row.add_levels(level);
    v1::DiscoveredSource& other = *sources.add_discovered();
    other.set_name("backup");
    other.set_address("10.0.0.8:5568");
    other.add_universes(9);
    const std::string text = sources_table(sources);
    for (const char* part : {"sacn on 0.0.0.0:5568: 88 packets, 0 bad", "patched universes 1-3,7", "over 200",
                             "front desk", "10.0.0.7:5568", " 150 ", " 44.0 ", "live", " 512 ",
                             "0 1 2 3 4 5 6 7 8 9 10 11 …", "backup at 10.0.0.8:5568 says it sends universes 9"})
        EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
    row.set_slot_priorities(true);
    EXPECT_NE(sources_table(sources).find(" slot "), std::string::npos);
    EXPECT_NE(sources_table({}).find("--sacn"), std::string::npos);
}

}  // namespace
}  // namespace gonio
