// Every message in both encodings, and what happens to bytes that are none.
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "protocol/schema/codec.h"
#include "protocol/schema/command.pb.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/state.pb.h"

namespace gonio {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::util::MessageDifferencer;

// Fills every field of a message with something, so that no field of the table can be forgotten by a test.
void fill(Message& message, int depth = 0) {
    const Descriptor* descriptor = message.GetDescriptor();
    const auto* reflection = message.GetReflection();
    for (int i = 0; i < descriptor->field_count(); ++i) {
        const FieldDescriptor* field = descriptor->field(i);
        if (field->real_containing_oneof() && reflection->HasOneof(message, field->real_containing_oneof())) continue;
        const int count = field->is_repeated() ? 3 : 1;
        for (int n = 0; n < count; ++n) {
            const int number = field->number() + n;
            switch (field->cpp_type()) {
                case FieldDescriptor::CPPTYPE_UINT32:
                    field->is_repeated() ? reflection->AddUInt32(&message, field, static_cast<std::uint32_t>(number))
                                         : reflection->SetUInt32(&message, field, 4'000'000'000u);
                    break;
                case FieldDescriptor::CPPTYPE_INT32:
                    reflection->SetInt32(&message, field, -2'000'000'000);
                    break;
                case FieldDescriptor::CPPTYPE_DOUBLE:
                    field->is_repeated() ? reflection->AddDouble(&message, field, number + 0.1)
                                         : reflection->SetDouble(&message, field, -number / 3.0);
                    break;
                case FieldDescriptor::CPPTYPE_BOOL:
                    field->is_repeated() ? reflection->AddBool(&message, field, true)
                                         : reflection->SetBool(&message, field, true);
                    break;
                case FieldDescriptor::CPPTYPE_STRING: {
                    const bool bytes = field->type() == FieldDescriptor::TYPE_BYTES;
                    const std::string text =
                        bytes ? std::string("\0\xff\x80 IES", 7) : "name \"" + field->name() + "\" é";
                    field->is_repeated() ? reflection->AddString(&message, field, text)
                                         : reflection->SetString(&message, field, text);
                    break;
                }
                case FieldDescriptor::CPPTYPE_MESSAGE:
                    ASSERT_LT(depth, 8);
                    fill(field->is_repeated() ? *reflection->AddMessage(&message, field)
                                              : *reflection->MutableMessage(&message, field),
                         depth + 1);
                    break;
                default:
                    FAIL() << field->full_name() << " has a type that scripts cannot read exactly";
            }
        }
    }
}

// Calls `test(message)` once for each member of the message's first oneof, filled.
template <typename T, typename Test>
void for_each_kind(const Test& test) {
    const auto* oneof = T::descriptor()->oneof_decl(0);
    for (int i = 0; i < oneof->field_count(); ++i) {
        T message;
        fill(*message.GetReflection()->MutableMessage(&message, oneof->field(i)));
        test(message, oneof->field(i)->name());
    }
}

TEST(Codec, EveryClientMessageComesBackInBothEncodings) {
    int kinds = 0;
    for_each_kind<v1::ClientMessage>([&](v1::ClientMessage& message, const std::string& name) {
        message.set_request_id(77);
        for (const Encoding encoding : {Encoding::proto, Encoding::json}) {
            const auto decoded = decode_client_message(encoding, encode_message(encoding, message));
            ASSERT_TRUE(decoded) << name << ": " << decoded.error().text();
            EXPECT_TRUE(MessageDifferencer::Equals(*decoded, message)) << name;
        }
        ++kinds;
    });
    EXPECT_GE(kinds, 10);
}

TEST(Codec, EveryCommandComesBackInBothEncodings) {
    for_each_kind<v1::Command>([&](const v1::Command& command, const std::string& name) {
        v1::ClientMessage message;
        *message.mutable_command() = command;
        for (const Encoding encoding : {Encoding::proto, Encoding::json}) {
            const auto decoded = decode_client_message(encoding, encode_message(encoding, message));
            ASSERT_TRUE(decoded) << name << ": " << decoded.error().text();
            EXPECT_TRUE(MessageDifferencer::Equals(*decoded, message)) << name;
        }
    });
}

TEST(Codec, EveryServerMessageComesBackInBothEncodings) {
    for_each_kind<v1::ServerMessage>([&](const v1::ServerMessage& message, const std::string& name) {
        for (const Encoding encoding : {Encoding::proto, Encoding::json}) {
            const auto decoded = decode_server_message(encoding, encode_message(encoding, message));
            ASSERT_TRUE(decoded) << name << ": " << decoded.error().text();
            EXPECT_TRUE(MessageDifferencer::Equals(*decoded, message)) << name;
        }
    });
}

TEST(Codec, JsonUsesTheNamesOfTheTableAndPrintsDefaults) {
    v1::ServerMessage message;
    message.mutable_result()->set_code("ok");
    message.mutable_result()->set_scene_rev(12);
    EXPECT_EQ(
        encode_message(Encoding::json, message),
        R"({"request_id":0,"result":{"code":"ok","field":"","value":"","message":"","scene_rev":12,"warnings":[],"retry_after_ms":0,"notes":[]}})");
    // Absent optional fields stay absent: in a patch they mean "unchanged".
    v1::State state;
    const std::string json = encode_message(Encoding::json, state);
    EXPECT_EQ(json.find("exposure_ev100"), std::string::npos);
    EXPECT_NE(json.find("\"lights\":[]"), std::string::npos);
}

// A number that is none of the field's is refused in words, to the request that has it and to no other.
TEST(Codec, NumbersThatDoNotFitAreRefusedInWords) {
    for (const auto& [number, id] :
         {std::pair{"1e30", 0u}, {"3.5", 0u}, {"4294967296", 0u}, {"9223372036854775808", 0u}}) {
        const std::string text = std::string(R"({"request_id":)") + number + R"(,"get_state":{}})";
        const auto message = decode_client_message(Encoding::json, text);
        ASSERT_FALSE(message) << number;
        EXPECT_EQ(message.error().code, "bad_message");
        EXPECT_EQ(message.error().where, "request_id");
        EXPECT_EQ(message.error().message, "The JSON value is not a whole number from 0 to 4294967295.");
        EXPECT_EQ(peek_request_id(Encoding::json, text), id) << number;
    }
    const std::string text = R"({"request_id":7,"command":{"set_size":{"width_px":9223372036854775808}}})";
    const auto message = decode_client_message(Encoding::json, text);
    ASSERT_FALSE(message);
    EXPECT_EQ(message.error().where, "command.set_size.width_px");
    EXPECT_EQ(message.error().value, "9223372036854775808");
    EXPECT_EQ(peek_request_id(Encoding::json, text), 7u);
}

TEST(Codec, BothSpellingsOfANameAndUnknownFieldsAreAccepted) {
    const auto message = decode_client_message(
        Encoding::json,
        R"({"requestId": 5, "later": {"x": [1]}, "command": {"set_light": {"name": "a", "level_ratio": 0.5, "shine": 1}}})");
    ASSERT_TRUE(message) << message.error().text();
    EXPECT_EQ(message->request_id(), 5u);
    EXPECT_DOUBLE_EQ(message->command().set_light().level_ratio(), 0.5);
    EXPECT_FALSE(message->command().set_light().has_pan_rad());
}

TEST(Codec, NotANumberReachesTheServer) {
    v1::ClientMessage message;
    message.mutable_command()->mutable_set_light()->add_position_m(std::numeric_limits<double>::quiet_NaN());
    for (const Encoding encoding : {Encoding::proto, Encoding::json}) {
        const auto decoded = decode_client_message(encoding, encode_message(encoding, message));
        ASSERT_TRUE(decoded);
        EXPECT_NE(decoded->command().set_light().position_m(0), decoded->command().set_light().position_m(0));
    }
}

struct Refusal {
    std::string bytes, code, where, value;
};

TEST(Codec, MalformedJsonIsRefusedWithWhatIsKnown) {
    const Refusal refusals[] = {
        {"", "bad_message", "", ""},
        {"{", "bad_message", "", ""},
        {"[]", "bad_message", "", ""},
        {"null", "bad_message", "", ""},
        {"{\"stats\":{}} x", "bad_message", "", "{\"stats\":{}} x"},
        {"{}", "unsupported", "message", ""},
        {"{\"fly\":{}}", "unsupported", "message", ""},
        {"{\"command\":{}}", "unsupported", "command", ""},
        {"{\"command\":{\"fly\":{}}}", "unsupported", "command", ""},
        {"{\"command\":5}", "bad_message", "command", "5"},
        {"{\"request_id\":-1,\"stats\":{}}", "bad_message", "request_id", "-1"},
        {"{\"command\":{\"set_light\":{\"level_ratio\":\"x\"}}}", "bad_message", "command.set_light.level_ratio",
         "\"x\""},
        {"{\"command\":{\"set_light\":{\"position_m\":[1,\"q\"]}}}", "bad_message", "command.set_light.position_m[1]",
         "\"q\""},
        {"{\"command\":{\"set_light\":{\"profile\":{\"photometry\":\"*\"}}}}", "bad_message",
         "command.set_light.profile.photometry", "\"*\""},
        {"{\"stats\":{},\"meter\":{}}", "bad_message", "", ""},
    };
    for (const Refusal& expected : refusals) {
        const auto message = decode_client_message(Encoding::json, expected.bytes);
        ASSERT_FALSE(message) << expected.bytes;
        EXPECT_EQ(message.error().code, expected.code) << expected.bytes;
        EXPECT_EQ(message.error().where, expected.where) << expected.bytes;
        EXPECT_EQ(message.error().value, expected.value) << expected.bytes;
        EXPECT_FALSE(message.error().message.empty());
    }
}

TEST(Codec, NestingIsCapped) {
    // 32 levels pass (of an unknown field), one more does not; brackets in strings do not count.
    const auto nested = [](int levels) {
        return "{\"x\":" + std::string(static_cast<std::size_t>(levels - 1), '[') +
               std::string(static_cast<std::size_t>(levels - 1), ']') + ",\"stats\":{}}";
    };
    EXPECT_TRUE(decode_client_message(Encoding::json, nested(32)));
    const auto deep = decode_client_message(Encoding::json, nested(33));
    ASSERT_FALSE(deep);
    EXPECT_EQ(deep.error().where, "byte 36");
    EXPECT_FALSE(decode_client_message(Encoding::json, nested(1'000'000)));
    EXPECT_TRUE(decode_client_message(Encoding::json, "{\"x\":\"" + std::string(100, '[') + "\\\"{\",\"stats\":{}}"));
}

TEST(Codec, OversizeIsRefused) {
    for (const Encoding encoding : {Encoding::proto, Encoding::json}) {
        const auto message = decode_client_message(encoding, std::string(kMaxMessageBytes + 1, ' '));
        ASSERT_FALSE(message);
        EXPECT_EQ(message.error().code, "too_large");
    }
}

TEST(Codec, AServersCaptureMayBeLarger) {
    v1::ServerMessage message;
    message.mutable_capture()->set_image(std::string(8u << 20, 'x'));
    const auto read = decode_server_message(Encoding::proto, encode_message(Encoding::proto, message));
    ASSERT_TRUE(read) << read.error().text();
    EXPECT_EQ(read->capture().image().size(), 8u << 20);
}

TEST(Codec, BrokenProtobufNamesThePlace) {
    v1::ClientMessage message;
    message.set_request_id(300);
    message.mutable_command()->mutable_set_light()->set_name("abc");
    std::string bytes = message.SerializeAsString();
    const auto cut = decode_client_message(Encoding::proto, bytes.substr(0, bytes.size() - 1));
    ASSERT_FALSE(cut);
    EXPECT_EQ(cut.error().code, "bad_message");
    EXPECT_EQ(cut.error().where, "byte 3");  // where `command` begins
    EXPECT_EQ(peek_request_id(Encoding::proto, bytes.substr(0, bytes.size() - 1)), 300u);
    std::string inner = bytes;
    inner[inner.size() - 4] = 9;  // the name's length reaches beyond its message
    const auto bad_name = decode_client_message(Encoding::proto, inner);
    ASSERT_FALSE(bad_name);
    EXPECT_EQ(bad_name.error().where, "command.set_light byte 7");
    std::string latin = bytes;
    latin.back() = '\xe9';
    const auto not_utf8 = decode_client_message(Encoding::proto, latin);
    ASSERT_FALSE(not_utf8);
    EXPECT_EQ(not_utf8.error().code, "bad_message");
    EXPECT_FALSE(decode_client_message(Encoding::proto, ""));
    EXPECT_FALSE(decode_client_message(Encoding::proto, std::string(1000, '\x0b')));  // groups without end
}

TEST(Codec, RequestIdOfBrokenJson) {
    EXPECT_EQ(peek_request_id(Encoding::json, "{\"request_id\" : 17, \"command\": 5}"), 17u);
    EXPECT_EQ(peek_request_id(Encoding::json, "{\"command\": 5}"), 0u);
    EXPECT_EQ(peek_request_id(Encoding::json, "{\"request_id\""), 0u);
    EXPECT_EQ(peek_request_id(Encoding::json, "{\"request_id\":99999999999999999999}"), 0u);
}

TEST(Codec, DamagedMessagesNeverCrash) {
    v1::ClientMessage message;
    fill(*message.mutable_command()->mutable_set_light());
    std::mt19937 random(1);
    for (const Encoding encoding : {Encoding::proto, Encoding::json}) {
        const std::string whole = encode_message(encoding, message);
        for (int round = 0; round < 3000; ++round) {
            std::string bytes = whole;
            for (int hits = 1 + static_cast<int>(random() % 4); hits > 0; --hits)
                bytes[random() % bytes.size()] = static_cast<char>(random());
            if (random() % 4 == 0) bytes.resize(random() % bytes.size());
            const auto decoded = decode_client_message(encoding, bytes);
            if (!decoded) {
                EXPECT_FALSE(decoded.error().code.empty());
            }
            (void)peek_request_id(encoding, bytes);
        }
    }
}

}  // namespace
}  // namespace gonio
