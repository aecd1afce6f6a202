// The corpus of the message fuzzers, and damaged copies of it, through the same checks as the fuzzers.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "tests/fuzz/damaged.h"
#include "tests/fuzz/message_check.h"

namespace gonio {
namespace {

TEST(MessageReplay, TheCorpusAndDamagedCopiesOfIt) {
    std::mt19937 random(7);
    std::size_t inputs = 0, good = 0;
    for (const auto& entry : std::filesystem::directory_iterator(GONIO_SOURCE_DIR "/tests/fuzz/message_corpus")) {
        std::ifstream file(entry.path(), std::ios::binary);
        const std::string whole((std::istreambuf_iterator<char>(file)), {});
        const std::string name = entry.path().filename();
        for (unsigned i = 0; i < 20; ++i) {
            const std::string bytes = fuzz::damaged(whole, i, random);
            if (name.starts_with("server")) {
                fuzz::check_server_bytes(bytes);
            } else {
                const Encoding encoding = name.starts_with("json") ? Encoding::json : Encoding::proto;
                fuzz::check_client_message(encoding, bytes);
                if (i == 0) good += decode_client_message(encoding, bytes) ? 1 : 0;
            }
            ++inputs;
        }
    }
    EXPECT_GE(inputs, 1000u);
    EXPECT_GE(good, 50u) << "seeds that are messages";
}

TEST(MessageReplay, DeepJsonIsRefusedAtAnyDepth) {
    for (const std::size_t depth : {10u, 33u, 1000u, 100'000u}) {
        for (const char* open : {"[", "{\"a\":", "{\"command\":"}) {
            std::string text = R"({"request_id":1,"command":)";
            for (std::size_t i = 0; i < depth; ++i) text += open;
            fuzz::check_client_message(Encoding::json, text);
            fuzz::check_client_message(Encoding::json,
                                       text + "1" + std::string(depth, open[0] == '[' ? ']' : '}') + "}");
        }
    }
}

}  // namespace
}  // namespace gonio
