// The examples of PROTOCOL.md are true: they parse, they are complete, and the header's bytes are those of the golden
// test.
#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>

#include "protocol/schema/codec.h"
#include "protocol/schema/command.pb.h"
#include "protocol/schema/frame_header.h"
#include "protocol/schema/gonio.pb.h"

namespace gonio {
namespace {

std::string protocol_page() {
    std::ifstream file(GONIO_SOURCE_DIR "/protocol/schema/PROTOCOL.md");
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
}

// The lines of all code blocks that are marked "json client" or "json server".
std::vector<std::string> examples(const std::string& side) {
    std::istringstream page(protocol_page());
    std::vector<std::string> lines;
    bool inside = false;
    for (std::string line; std::getline(page, line);) {
        if (line == "```json " + side)
            inside = true;
        else if (line == "```")
            inside = false;
        else if (inside)
            lines.push_back(line);
    }
    return lines;
}

// Whether the example says what the message says: nothing in it was ignored as unknown.
bool nothing_unknown(const std::string& example, const google::protobuf::Message& message) {
    const std::string known = encode_message(Encoding::json, message);
    for (std::size_t at = example.find('"'); at != std::string::npos; at = example.find('"', at + 1)) {
        const std::size_t end = example.find('"', at + 1);
        if (end == std::string::npos) return false;
        const std::string word = example.substr(at, end - at + 1);
        if (example[end + 1] == ':' && known.find(word + ":") == std::string::npos) return false;
        at = end;
    }
    return true;
}

TEST(ProtocolPage, EveryClientExampleParsesAndEveryKindHasOne) {
    std::set<int> kinds, commands;
    for (const std::string& line : examples("client")) {
        const auto message = decode_client_message(Encoding::json, line);
        ASSERT_TRUE(message) << line << "\n" << message.error().text();
        EXPECT_TRUE(nothing_unknown(line, *message)) << line;
        kinds.insert(message->message_case());
        if (message->has_command()) commands.insert(message->command().command_case());
    }
    const auto* table = v1::ClientMessage::descriptor()->oneof_decl(0);
    for (int i = 0; i < table->field_count(); ++i)
        EXPECT_TRUE(kinds.contains(table->field(i)->number())) << "no example of " << table->field(i)->name();
    table = v1::Command::descriptor()->oneof_decl(0);
    for (int i = 0; i < table->field_count(); ++i)
        EXPECT_TRUE(commands.contains(table->field(i)->number())) << "no example of " << table->field(i)->name();
}

TEST(ProtocolPage, EveryServerExampleParses) {
    std::set<int> kinds;
    for (const std::string& line : examples("server")) {
        const auto message = decode_server_message(Encoding::json, line);
        ASSERT_TRUE(message) << line << "\n" << message.error().text();
        EXPECT_TRUE(nothing_unknown(line, *message)) << line;
        kinds.insert(message->message_case());
    }
    EXPECT_GE(kinds.size(), 11u);
}

TEST(ProtocolPage, TheExampleHeaderDecodes) {
    const std::string page = protocol_page();
    const std::string before = "encode_us 1234:\n\n```\n";
    const std::size_t begin = page.find(before) + before.size();
    std::istringstream hex(page.substr(begin, page.find('`', begin) - begin));
    std::vector<std::byte> bytes;
    for (std::string byte; hex >> byte;) bytes.push_back(static_cast<std::byte>(std::stoi(byte, nullptr, 16)));
    ASSERT_EQ(bytes.size(), kFrameHeaderBytes);
    const auto header = decode_frame_header(bytes);
    ASSERT_TRUE(header);
    EXPECT_TRUE(header->key && header->final);
    EXPECT_EQ(header->lane, 5);
    EXPECT_EQ(header->seq, 0x01020304u);
    EXPECT_EQ(header->scene_rev, 42u);
    EXPECT_EQ(header->rendered_ns, 0x0102030405060708u);
    EXPECT_EQ(header->render_us, 10000u);
    EXPECT_EQ(header->encode_us, 1234u);
}

TEST(ProtocolPage, NamesTheCodesOfThisFolderAndTheFront) {
    const std::string page = protocol_page();
    for (const char* code :
         {"bad_message", "unsupported", "unexpected", "busy", "too_large", "usage", "file_unreadable", "encoder_failed",
          "encoder_unavailable", "listen_failed", "bad_frame_header", "4002", "4003", "4009", "1009"})
        EXPECT_NE(page.find(code), std::string::npos) << code;
}

}  // namespace
}  // namespace gonio
