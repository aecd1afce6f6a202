// RFC 6455 section 5: frames, fragments, control frames; and the sizes of section 10.4.
#include "protocol/schema/codec.h"
#include "protocol/schema/gonio.pb.h"
#include "tests/conformance/cases.h"
#include "tests/conformance/raw_peer.h"

namespace gonio::conformance {
namespace {

std::string text(const std::string& payload, const FrameShape& shape = {}) {
    return frame(kText, payload, shape);
}
FrameShape unfinished() {
    FrameShape shape;
    shape.fin = false;
    return shape;
}
FrameShape with_rsv(int rsv) {
    FrameShape shape;
    shape.rsv = rsv;
    return shape;
}
FrameShape unmasked() {
    FrameShape shape;
    shape.masked = false;
    return shape;
}
FrameShape with_length_bytes(int bytes) {
    FrameShape shape;
    shape.length_bytes = bytes;
    return shape;
}
FrameShape announcing(std::uint64_t length) {
    FrameShape shape;
    shape.length_bytes = 8;
    shape.announced_length = length;
    return shape;
}
FrameShape with_mask(std::uint32_t mask) {
    FrameShape shape;
    shape.mask = mask;
    return shape;
}

// A request whose payload has this length, and the text that its answer repeats.
struct Sized {
    std::string payload, repeated;
};
Sized sized(std::size_t length) {
    const std::string repeated(length - echo_request("").size(), 'n');
    return {echo_request(repeated), repeated};
}

std::string identify_of(std::size_t length) {
    const std::string start = R"({"identify":{"client":")", end = R"(","state":true}})";
    return start + std::string(length - start.size() - end.size(), 'i') + end;
}

}  // namespace

std::vector<Case> framing_cases() {
    std::vector<Case> cases;
    const auto add = [&](std::string name, std::string clause, std::vector<Step> steps,
                         std::vector<std::string> expected) {
        cases.push_back({std::move(name), std::move(clause), Stage::joined, std::move(steps), std::move(expected)});
    };
    const std::string hello = echo_request("Hello"), head = hello.substr(0, 9), tail = hello.substr(9);

    // ---- lengths
    for (const std::size_t length : {124u, 125u, 126u, 127u, 128u, 65535u, 65536u, 65537u, 1000000u}) {
        const Sized message = sized(length);
        add("TextOf" + std::to_string(length), "5.2 (payload length)", {{text(message.payload)}},
            {"echo " + message.repeated});
    }
    add("SixteenBitsFor125", "5.2 (the minimal number of bytes)", {{text(sized(125).payload, with_length_bytes(2))}},
        {"close 1002", "end"});
    add("SixtyFourBitsFor125", "5.2 (the minimal number of bytes)", {{text(sized(125).payload, with_length_bytes(8))}},
        {"close 1002", "end"});
    add("SixtyFourBitsFor126", "5.2 (the minimal number of bytes)", {{text(sized(126).payload, with_length_bytes(8))}},
        {"close 1002", "end"});
    add("SixtyFourBitsFor65535", "5.2 (the minimal number of bytes)",
        {{text(sized(65535).payload, with_length_bytes(8))}}, {"close 1002", "end"});
    add("TheHighestBitOfALength", "5.2 (must be 0)", {{text("", announcing(std::uint64_t{1} << 63))}},
        {"close 1002 | close 1009", "end"});
    add("TwoToThe62Bytes", "7.4.1, 10.4", {{text("", announcing(std::uint64_t{1} << 62))}}, {"close 1009", "end"});

    // ---- masks
    add("AMaskOfZeros", "5.3", {{text(hello, with_mask(0))}}, {"echo Hello"});
    add("AMaskOfOnes", "5.3", {{text(hello, with_mask(0xffffffff))}}, {"echo Hello"});
    add("EachFrameItsOwnMask", "5.3",
        {{frame(kText, head, unfinished()) + frame(kContinuation, tail, with_mask(0x80000001))}}, {"echo Hello"});
    add("AnUnmaskedText", "5.1 (must close)", {{text(hello, unmasked())}}, {"close 1002", "end"});
    add("AnUnmaskedPing", "5.1 (must close)", {{frame(kPing, "a", unmasked())}}, {"close 1002", "end"});
    add("AnUnmaskedClose", "5.1 (must close)", {{frame(kClose, close_payload(1000), unmasked())}},
        {"close 1002", "end"});
    add("AnUnmaskedContinuation", "5.1 (must close)",
        {{frame(kText, head, unfinished()) + frame(kContinuation, tail, unmasked())}}, {"close 1002", "end"});

    // ---- reserved bits and opcodes
    for (const int rsv : {1, 2, 4, 7}) {
        const std::string name = "Rsv" + std::to_string(rsv);
        add(name + "OnText", "5.2 (RSV must be 0)", {{text(hello, with_rsv(rsv))}}, {"close 1002", "end"});
        add(name + "OnPing", "5.2 (RSV must be 0)", {{frame(kPing, "a", with_rsv(rsv))}}, {"close 1002", "end"});
    }
    add("RsvOnContinuation", "5.2 (RSV must be 0)",
        {{frame(kText, head, unfinished()) + frame(kContinuation, tail, with_rsv(4))}}, {"close 1002", "end"});
    for (const int opcode : {3, 4, 5, 6, 7, 11, 12, 13, 14, 15})
        add("Opcode" + std::to_string(opcode), "5.2 (reserved: must fail)", {{frame(opcode, "x")}},
            {"close 1002", "end"});
    add("AReservedOpcodeAmongFragments", "5.2 (reserved: must fail)",
        {{frame(kText, head, unfinished()) + frame(3, "x")}}, {"close 1002", "end"});

    // ---- how frames come
    add("ByteByByte", "5.2, 5.4", {{text(hello), Step::How::slowly}}, {"echo Hello"});
    add("SixteenBitLengthByteByByte", "5.2", {{text(sized(300).payload), Step::How::slowly}},
        {"echo " + sized(300).repeated});
    add("APauseInTheHeader", "5.2",
        {{text(sized(300).payload).substr(0, 3)}, {"", Step::How::pause}, {text(sized(300).payload).substr(3)}},
        {"echo " + sized(300).repeated});
    add("APauseInThePayload", "5.2", {{text(hello).substr(0, 20)}, {"", Step::How::pause}, {text(hello).substr(20)}},
        {"echo Hello"});
    add("TwoMessagesInOneSegment", "5.2", {{text(echo_request("a")) + text(echo_request("b"))}}, {"echo a", "echo b"});
    {
        std::string bytes;
        std::vector<std::string> expected;
        for (int i = 0; i < 20; ++i) {
            bytes += text(echo_request(std::to_string(i)));
            expected.push_back("echo " + std::to_string(i));
        }
        add("TwentyMessagesInOrder", "5.2", {{bytes}}, expected);
    }
    add("AnEmptyMessage", "5.2, 5.6", {{text("")}}, {"refusal bad_message"});
    add("ABinaryMessageWhereTextIsSpoken", "1.9 (the subprotocol's)", {{frame(kBinary, hello)}},
        {"refusal bad_message"});
    {
        Case binary{"ABinaryMessage", "5.6", Stage::joined, {}, {"echo Hello"}, "gonio.v1.proto"};
        v1::ClientMessage message;
        message.set_request_id(7);
        message.mutable_profile()->set_light("Hello");
        const std::string bytes = "\x01" + message.SerializeAsString();
        binary.steps = {{frame(kBinary, bytes)}};
        cases.push_back(binary);
        binary.name = "ABinaryMessageInFragmentsOfAByte";
        binary.clause = "5.4";
        binary.steps = {{fragments(kBinary, bytes, 1)}};
        cases.push_back(binary);
        binary.name = "BinaryBytesNeedNotBeUtf8";
        binary.clause = "5.6 (arbitrary)";
        binary.steps = {{frame(kBinary, "\x01\xff\xfe\xc0\x80")}};
        binary.expected = {"refusal bad_message"};
        cases.push_back(binary);
        binary.name = "ATextMessageWhereBinaryIsSpoken";
        binary.clause = "1.9 (the subprotocol's)";
        binary.steps = {{text("hello")}};
        cases.push_back(binary);
    }

    // ---- fragments
    add("TwoFragments", "5.4", {{fragments(kText, hello, hello.size() / 2 + 1)}}, {"echo Hello"});
    add("FragmentsOfAByte", "5.4", {{fragments(kText, hello, 1)}}, {"echo Hello"});
    add("FragmentsOfAByteInSegmentsOfAByte", "5.4", {{fragments(kText, hello, 1), Step::How::slowly}}, {"echo Hello"});
    add("AnEmptyFirstFragment", "5.4", {{frame(kText, "", unfinished()) + frame(kContinuation, hello)}},
        {"echo Hello"});
    add("AnEmptyMiddleFragment", "5.4",
        {{frame(kText, head, unfinished()) + frame(kContinuation, "", unfinished()) + frame(kContinuation, tail)}},
        {"echo Hello"});
    add("AnEmptyLastFragment", "5.4", {{frame(kText, hello, unfinished()) + frame(kContinuation, "")}}, {"echo Hello"});
    add("EmptyFragmentsAlone", "5.4", {{frame(kText, "", unfinished()) + frame(kContinuation, "")}},
        {"refusal bad_message"});
    {
        std::string bytes = frame(kText, head, unfinished());
        for (int i = 0; i < 5000; ++i) bytes += frame(kContinuation, "", unfinished());
        add("FiveThousandEmptyFragments", "5.4, 10.4", {{bytes + frame(kContinuation, tail)}}, {"echo Hello"});
    }
    add("ContinuationOfNothing", "5.4", {{frame(kContinuation, hello)}}, {"close 1002", "end"});
    add("AnUnfinishedContinuationOfNothing", "5.4", {{frame(kContinuation, hello, unfinished())}},
        {"close 1002", "end"});
    add("ContinuationAfterTheLast", "5.4", {{fragments(kText, hello, 9) + frame(kContinuation, "x")}},
        {"echo Hello | close 1002", "close 1002 | end"});
    add("ANewTextInsideAMessage", "5.4 (must not be interleaved)", {{frame(kText, head, unfinished()) + text(hello)}},
        {"close 1002", "end"});
    add("ABinaryInsideAMessage", "5.4 (must not be interleaved)",
        {{frame(kText, head, unfinished()) + frame(kBinary, "x")}}, {"close 1002", "end"});

    // ---- control frames
    add("APingInsideAMessage", "5.4, 5.5",
        {{frame(kText, head, unfinished()) + frame(kPing, "in") + frame(kContinuation, tail)}},
        {"pong in", "echo Hello"});
    add("PingsBetweenFragmentsOfAByte", "5.4, 5.5",
        {{frame(kText, hello.substr(0, 1), unfinished()) + frame(kPing, "1") +
          frame(kContinuation, hello.substr(1, 1), unfinished()) + frame(kPong, "?") + frame(kPing, "2") +
          frame(kContinuation, hello.substr(2))}},
        {"pongs 2", "echo Hello"});
    add("APongInsideAMessage", "5.4, 5.5.3",
        {{frame(kText, head, unfinished()) + frame(kPong, "x") + frame(kContinuation, tail)}}, {"echo Hello"});
    add("APing", "5.5.2", {{frame(kPing, "payload")}}, {"pong payload"});
    add("AnEmptyPing", "5.5.2", {{frame(kPing, "")}}, {"pong "});
    add("APingOf125", "5.5, 5.5.2", {{frame(kPing, std::string(125, 'p'))}}, {"pong " + std::string(125, 'p')});
    add("APingOfAnyBytes", "5.5.2", {{frame(kPing, "\xff\xfe\xc0 \x80")}}, {"pong \xff\xfe\xc0 \x80"});
    add("APingByteByByte", "5.5.2", {{frame(kPing, "slow"), Step::How::slowly}}, {"pong slow"});
    add("APingOf126", "5.5 (125 bytes or less)", {{frame(kPing, std::string(126, 'p'))}}, {"close 1002", "end"});
    add("ASixteenBitPing", "5.5 (125 bytes or less)", {{frame(kPing, "p", with_length_bytes(2))}},
        {"close 1002", "end"});
    add("AFragmentedPing", "5.5 (must not be fragmented)", {{frame(kPing, "p", unfinished())}}, {"close 1002", "end"});
    add("AFragmentedPong", "5.5 (must not be fragmented)", {{frame(kPong, "p", unfinished())}}, {"close 1002", "end"});
    add("AFragmentedClose", "5.5 (must not be fragmented)", {{frame(kClose, close_payload(1000), unfinished())}},
        {"close 1002", "end"});
    add("APongOf126", "5.5 (125 bytes or less)", {{frame(kPong, std::string(126, 'p'))}}, {"close 1002", "end"});
    add("AnUnsolicitedPong", "5.5.3 (not answered)", {{frame(kPong, "unasked") + frame(kPong, "")}}, {});
    {
        std::string bytes;
        for (int i = 0; i < 200; ++i) bytes += frame(kPing, std::to_string(i));
        add("TwoHundredPings", "5.5.2, 5.5.3 (the newest is answered)", {{bytes}}, {"pongs 199"});
    }
    cases.push_back({"APingBeforeIdentify",
                     "5.5.2",
                     Stage::upgraded,
                     {{frame(kPing, "early")}},
                     {"pong early", "close 4002", "end"}});
    return cases;
}

std::vector<Case> limit_cases() {
    std::vector<Case> cases;
    const auto add = [&](std::string name, std::string clause, Stage stage, std::vector<Step> steps,
                         std::vector<std::string> expected) {
        cases.push_back({std::move(name), std::move(clause), stage, std::move(steps), std::move(expected)});
    };
    const Sized most = sized(kMaxMessageBytes),
                over = sized(kMaxMessageBytes + 2);  // a kind byte's worth is let through
    add("TheGreatestMessage", "10.4", Stage::joined, {{text(most.payload)}}, {"echo " + most.repeated});
    add("TheGreatestMessageInFragments", "10.4", Stage::joined, {{fragments(kText, most.payload, 65536)}},
        {"echo " + most.repeated});
    add("AMessageTooGreat", "7.4.1 (1009), 10.4", Stage::joined, {{text(over.payload)}}, {"close 1009", "end"});
    add("AnAnnouncementTooGreat", "7.4.1 (1009), 10.4", Stage::joined, {{text("", announcing(kMaxMessageBytes + 2))}},
        {"close 1009", "end"});
    add("FragmentsThatAreTooGreatTogether", "7.4.1 (1009), 10.4", Stage::joined,
        {{fragments(kText, over.payload, 65536)}}, {"close 1009", "end"});
    add("IdentifyOf4096", "10.4", Stage::upgraded, {{text(identify_of(4096))}}, {"ready"});
    add("IdentifyOf4097", "7.4.1 (1009), 10.4", Stage::upgraded, {{text(identify_of(4097))}}, {"close 1009", "end"});
    add("IdentifyInFragments", "5.4", Stage::upgraded, {{fragments(kText, identify_of(100), 7)}}, {"ready"});
    add("SomethingElseBeforeIdentify", "7.4.2 (4002)", Stage::upgraded, {{text(echo_request("x"))}},
        {"close 4002", "end"});
    add("NoIdentify", "7.4.2 (4002)", Stage::upgraded, {}, {"close 4002", "end"});
    add("HalfAnIdentify", "7.4.2 (4002)", Stage::upgraded, {{text(identify_of(100)).substr(0, 50)}},
        {"close 4002", "end"});
    add("SilenceIsPingedThenDropped", "5.5.2", Stage::joined, {}, {"ping", "end"});
    add("HalfAMessageThenSilence", "5.5.2", Stage::joined, {{text(echo_request("x")).substr(0, 20)}}, {"ping", "end"});
    return cases;
}

}  // namespace gonio::conformance
