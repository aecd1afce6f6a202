#include "protocol/schema/codec.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/stubs/logging.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/wire_format_lite.h>

#include <algorithm>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/session.pb.h"
#include "protocol/text/text_bytes.h"

namespace gonio {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;

constexpr int kMaxJsonNesting = 32;
constexpr std::size_t kShownBytes = 64;  // of an offending value

// Walks the bytes of one message of type `descriptor` as the parser would. Result: the place of the first thing that is
// not well-formed, as "path byte N", or empty if the wire format is sound (then a string was not UTF-8).
std::string first_bad_place(CodedInputStream& in, const Descriptor* descriptor, const std::string& path, int depth) {
    const auto place = [&](int offset) { return (path.empty() ? "byte " : path + " byte ") + std::to_string(offset); };
    for (;;) {
        const int start = in.CurrentPosition();
        if (in.BytesUntilLimit() == 0) return {};
        const std::uint32_t tag = in.ReadTag();
        if (tag == 0) return in.BytesUntilLimit() == 0 && in.CurrentPosition() == start ? std::string() : place(start);
        const FieldDescriptor* field =
            descriptor ? descriptor->FindFieldByNumber(WireFormatLite::GetTagFieldNumber(tag)) : nullptr;
        const bool is_message = field && field->type() == FieldDescriptor::TYPE_MESSAGE &&
                                WireFormatLite::GetTagWireType(tag) == WireFormatLite::WIRETYPE_LENGTH_DELIMITED;
        if (is_message && depth > 0) {
            std::uint32_t length = 0;
            if (!in.ReadVarint32(&length) || static_cast<std::int64_t>(length) > in.BytesUntilLimit())
                return place(start);
            const auto limit = in.PushLimit(static_cast<int>(length));
            std::string bad = first_bad_place(in, field->message_type(),
                                              path.empty() ? field->name() : path + "." + field->name(), depth - 1);
            if (!bad.empty()) return bad;
            in.PopLimit(limit);
        } else if (!WireFormatLite::SkipField(&in, tag)) {
            return place(start);
        }
    }
}

std::string first_bad_place(std::string_view bytes, const Descriptor* descriptor) {
    CodedInputStream in(reinterpret_cast<const std::uint8_t*>(bytes.data()), static_cast<int>(bytes.size()));
    const auto limit = in.PushLimit(static_cast<int>(bytes.size()));
    std::string place = first_bad_place(in, descriptor, "", 16);
    in.PopLimit(limit);
    return place;
}

// Result: the byte offset at which objects and arrays nest deeper than kMaxJsonNesting, or npos.
std::size_t too_deep_at(std::string_view json) {
    int depth = 0;
    bool in_string = false;
    for (std::size_t i = 0; i < json.size(); ++i) {
        const char c = json[i];
        if (in_string) {
            if (c == '\\') ++i;
            if (c == '"') in_string = false;
        } else if (c == '"') {
            in_string = true;
        } else if (c == '{' || c == '[') {
            if (++depth > kMaxJsonNesting) return i;
        } else if (c == '}' || c == ']') {
            --depth;
        }
    }
    return std::string_view::npos;
}

// type: as protobuf's JSON parser names it. Result: what a value of it is.
std::string words_of_type(const std::string& type) {
    static constexpr std::pair<std::string_view, std::string_view> kWords[] = {
        {"TYPE_UINT32", "a whole number from 0 to 4294967295"},
        {"TYPE_INT32", "a whole number from -2147483648 to 2147483647"},
        {"TYPE_DOUBLE", "a number"},
        {"TYPE_BOOL", "true or false"},
        {"TYPE_STRING", "a text"},
        {"TYPE_BYTES", "a text in base64"},
    };
    for (const auto& [name, words] : kWords)
        if (type == name) return std::string(words);
    return "a " + type;
}

// protobuf's JSON parser says "(path): what" for a value of the wrong type and "what.\nthe line\n   ^" for bad syntax.
Error json_refusal(std::string text) {
    Error error{"bad_message", "", "", ""};
    if (const std::size_t line_end = text.find('\n'); line_end != std::string::npos) {
        const std::string_view rest = std::string_view(text).substr(line_end + 1);
        error.value = shown_text(rest.substr(0, rest.find('\n')), kShownBytes);
        text.resize(line_end);
    }
    if (text.starts_with("(")) {
        // "(command.set_light) level_ratio: invalid value …" or "(message): …": the name after the bracket belongs to
        // the path.
        const std::size_t close = text.find(") ");
        const std::size_t colon = text.find(": ", 1);
        if (close != std::string::npos && colon != std::string::npos && close < colon) {
            error.where = text.substr(1, close - 1) + "." + text.substr(close + 2, colon - close - 2);
            text.erase(0, colon + 2);
        } else if (const std::size_t end = text.find("): "); end != std::string::npos) {
            error.where = text.substr(1, end - 1);
            text.erase(0, end + 3);
        }
    }
    constexpr std::string_view invalid = "invalid value ", type = " for type ";
    if (const std::size_t end = text.rfind(type); text.starts_with(invalid) && end != std::string::npos) {
        error.value = shown_text(std::string_view(text).substr(invalid.size(), end - invalid.size()), kShownBytes);
        error.message = "The JSON value is not " + words_of_type(text.substr(end + type.size())) + ".";
        return error;
    }
    if (text.starts_with(": ")) text.erase(0, 2);
    error.message = "The JSON text is not a message of this protocol: " + text;
    return error;
}

template <typename T>
Result<T> parse(Encoding encoding, std::string_view bytes, std::size_t limit) {
    if (bytes.size() > limit)
        return Error{"too_large", "byte " + std::to_string(limit), std::to_string(bytes.size()),
                     "The message is longer than " + std::to_string(limit >> 20) + " MiB."};
    T message;
    if (encoding == Encoding::proto) {
        // The library would log each bad string; whoever sent it hears of it instead.
        const google::protobuf::LogSilencer quiet;
        if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
            std::string place = first_bad_place(bytes, T::descriptor());
            if (place.empty()) return Error{"bad_message", "", "", "A string of the message is not UTF-8."};
            return Error{"bad_message", std::move(place), "", "The bytes are not a protobuf message of this protocol."};
        }
        return message;
    }
    if (const std::size_t at = too_deep_at(bytes); at != std::string_view::npos)
        return Error{"bad_message", "byte " + std::to_string(at), "", "The JSON text nests deeper than 32 levels."};
    google::protobuf::util::JsonParseOptions options;
    options.ignore_unknown_fields = true;
    const auto status = google::protobuf::util::JsonStringToMessage(
        google::protobuf::StringPiece(bytes.data(), bytes.size()), &message, options);
    if (!status.ok()) return json_refusal(std::string(status.message()));
    return message;
}

}  // namespace

Result<v1::ClientMessage> decode_client_message(Encoding encoding, std::string_view bytes) {
    auto message = parse<v1::ClientMessage>(encoding, bytes, kMaxMessageBytes);
    if (!message) return message;
    if (message->message_case() == v1::ClientMessage::MESSAGE_NOT_SET)
        return Error{"unsupported", "message", "", "The message asks for nothing that this server knows."};
    if (message->has_command() && message->command().command_case() == v1::Command::COMMAND_NOT_SET)
        return Error{"unsupported", "command", "", "The command is none that this server knows."};
    return message;
}

Result<v1::ServerMessage> decode_server_message(Encoding encoding, std::string_view bytes) {
    auto message = parse<v1::ServerMessage>(encoding, bytes, kMaxServerMessageBytes);
    if (!message) return message;
    if (message->message_case() == v1::ServerMessage::MESSAGE_NOT_SET)
        return Error{"unsupported", "message", "", "The message says nothing that this client knows."};
    return message;
}

v1::Result refusal(const Error& error) {
    constexpr std::size_t kMaxErrorText = 4096;
    v1::Result result;
    result.set_code(error.code);
    // What is told of may be no text.
    result.set_field(shortened_text(error.where, kMaxErrorText));
    result.set_value(shortened_text(error.value, kMaxErrorText));
    result.set_message(shortened_text(error.message, kMaxErrorText));
    return result;
}

std::string encode_message(Encoding encoding, const google::protobuf::Message& message) {
    if (encoding == Encoding::proto) return message.SerializeAsString();
    google::protobuf::util::JsonPrintOptions options;
    options.preserve_proto_field_names = true;
    options.always_print_primitive_fields = true;
    std::string text;
    // Fails only for well-known types with out-of-range content; this protocol has none.
    (void)google::protobuf::util::MessageToJsonString(message, &text, options);
    return text;
}

std::uint32_t peek_request_id(Encoding encoding, std::string_view bytes) {
    if (encoding == Encoding::proto) {
        const google::protobuf::LogSilencer quiet;
        v1::ClientMessage message;  // what was parsed before the bad place stays
        (void)message.ParsePartialFromArray(bytes.data(), static_cast<int>(std::min(bytes.size(), kMaxMessageBytes)));
        return message.request_id();
    }
    constexpr std::string_view key = "\"request_id\"";
    std::size_t at = bytes.find(key);
    if (at == std::string_view::npos) return 0;
    at = bytes.find_first_not_of(" \t\r\n:", at + key.size());
    std::uint64_t id = 0;
    for (; at < bytes.size() && bytes[at] >= '0' && bytes[at] <= '9' && id <= UINT32_MAX; ++at)
        id = id * 10 + static_cast<std::uint64_t>(bytes[at] - '0');
    const bool whole = at >= bytes.size() || std::string_view(".eE").find(bytes[at]) == std::string_view::npos;
    return whole && id <= UINT32_MAX ? static_cast<std::uint32_t>(id) : 0;
}

}  // namespace gonio
