// RFC 6455 section 8.1: text is UTF-8 (RFC 3629), however it is cut; and section 7: how connections close.
#include "tests/conformance/cases.h"
#include "tests/conformance/raw_peer.h"

namespace gonio::conformance {
namespace {

// Frames of a text message with cuts before these offsets.
std::string cut(const std::string& payload, const std::vector<std::size_t>& at, const std::string& between = "") {
    std::string bytes;
    std::size_t from = 0;
    for (std::size_t i = 0; i <= at.size(); ++i) {
        const std::size_t to = i < at.size() ? at[i] : payload.size();
        FrameShape shape;
        shape.fin = i == at.size();
        bytes += (i > 0 ? between : "") + frame(i == 0 ? kText : kContinuation, payload.substr(from, to - from), shape);
        from = to;
    }
    return bytes;
}

}  // namespace

std::vector<Case> text_cases() {
    std::vector<Case> cases;
    const auto add = [&](std::string name, std::string clause, std::string bytes, std::vector<std::string> expected,
                         Step::How how = Step::How::whole) {
        cases.push_back(
            {std::move(name), std::move(clause), Stage::joined, {{std::move(bytes), how}}, std::move(expected)});
    };
    struct Text {
        const char *name, *bytes;
    };
    const Text valid[] = {{"TwoBytes", "\xce\xba\xe1\xbd\xb9\xcf\x83\xce\xbc\xce\xb5"},
                          {"FourBytes", "\xf0\x9f\x98\x80"},
                          {"FirstOf2", "\xc2\x80"},
                          {"LastOf2", "\xdf\xbf"},
                          {"FirstOf3", "\xe0\xa0\x80"},
                          {"BeforeSurrogates", "\xed\x9f\xbf"},
                          {"AfterSurrogates", "\xee\x80\x80"},
                          {"LastOf3", "\xef\xbf\xbd"},
                          {"ANoncharacter", "\xef\xbf\xbf"},
                          {"FirstOf4", "\xf0\x90\x80\x80"},
                          {"TheLastOfAll", "\xf4\x8f\xbf\xbf"}};
    for (const Text& text : valid)
        add("Utf8" + std::string(text.name), "8.1, RFC 3629 3", frame(kText, echo_request(text.bytes)),
            {"echo " + std::string(text.bytes)});
    const std::string smile = echo_request("\xf0\x9f\x98\x80");
    const std::size_t inside = smile.find('\xf0') + 1;
    add("ACharacterInTwoFragments", "5.6, 8.1", cut(smile, {inside}), {"echo \xf0\x9f\x98\x80"});
    add("ACharacterInFourFragments", "5.6, 8.1", cut(smile, {inside, inside + 1, inside + 2}),
        {"echo \xf0\x9f\x98\x80"});
    add("APingInsideACharacter", "5.4, 8.1", cut(smile, {inside}, frame(kPing, "mid")),
        {"pongs mid", "echo \xf0\x9f\x98\x80"});
    add("ACharacterInFourSegments", "8.1", frame(kText, smile), {"echo \xf0\x9f\x98\x80"}, Step::How::slowly);

    const Text invalid[] = {{"ALoneContinuation", "\x80"},
                            {"TwoContinuations", "\xbf\x80"},
                            {"OverlongOf2", "\xc0\xaf"},
                            {"OverlongNul", "\xc0\x80"},
                            {"OverlongC1", "\xc1\xbf"},
                            {"OverlongOf3", "\xe0\x80\xaf"},
                            {"LastOverlongOf3", "\xe0\x9f\xbf"},
                            {"OverlongOf4", "\xf0\x80\x80\xaf"},
                            {"LastOverlongOf4", "\xf0\x8f\xbf\xbf"},
                            {"AHighSurrogate", "\xed\xa0\x80"},
                            {"ALowSurrogate", "\xed\xbf\xbf"},
                            {"APairOfSurrogates", "\xed\xa0\xbd\xed\xb8\x80"},
                            {"BeyondUnicode", "\xf4\x90\x80\x80"},
                            {"F5", "\xf5\x80\x80\x80"},
                            {"FiveBytes", "\xf8\x88\x80\x80\x80"},
                            {"SixBytes", "\xfc\x84\x80\x80\x80\x80"},
                            {"FE", "\xfe"},
                            {"FF", "\xff"},
                            {"AStartWithoutItsRest", "\xe2\x82"},
                            {"AStartBeforeAStart", "\xe2\xe2\x82\xac"},
                            {"Latin1", "caf\xe9 "}};
    for (const Text& text : invalid)
        add("NotUtf8" + std::string(text.name), "8.1 (must fail)", frame(kText, echo_request(text.bytes)),
            {"close 1007", "end"});
    const std::string half = "{\"a\":\"\xe2\x82";
    add("AMessageThatEndsInsideACharacter", "8.1 (must fail)", frame(kText, half), {"close 1007", "end"});
    add("FragmentsThatEndInsideACharacter", "8.1 (must fail)", cut(half, {half.size() - 1}), {"close 1007", "end"});
    add("ABadContinuationInTheNextFragment", "8.1 (must fail)", cut(half + "x\"}", {half.size()}),
        {"close 1007", "end"});
    add("ASurrogateInTwoFragments", "8.1 (must fail)", cut(echo_request("\xed\xa0\x80"), {echo_request("").size() - 2}),
        {"close 1007", "end"});
    add("BadTextInAFragmentedMessage", "8.1 (must fail)", cut(echo_request("ab\xff") + "more", {46}),
        {"close 1007", "end"});
    return cases;
}

std::vector<Case> closing_cases() {
    std::vector<Case> cases;
    const auto add = [&](std::string name, std::string clause, std::string bytes, std::vector<std::string> expected) {
        cases.push_back({std::move(name), std::move(clause), Stage::joined, {{std::move(bytes)}}, std::move(expected)});
    };
    for (const int code : {1000, 1001, 1002, 1003, 1007, 1008, 1009, 1010, 1011, 3000, 3999, 4000, 4999})
        add("Close" + std::to_string(code), "5.5.1, 7.4", frame(kClose, close_payload(code)),
            {"close " + std::to_string(code), "end"});
    for (const int code : {1012, 1013, 1014})  // registered with IANA since
        add("Close" + std::to_string(code), "7.4.2", frame(kClose, close_payload(code)),
            {"close " + std::to_string(code) + " | close 1002", "end"});
    for (const int code : {0, 999, 1004, 1005, 1006, 1015, 1016, 1100, 2000, 2999})
        add("Close" + std::to_string(code), "7.4.1, 7.4.2 (must not be sent)", frame(kClose, close_payload(code)),
            {"close 1002", "end"});
    for (const int code : {5000, 65535})  // the RFC gives these no meaning; Beast echoes them
        add("Close" + std::to_string(code), "7.4.2 (says nothing of them)", frame(kClose, close_payload(code)),
            {"close 1002 | close " + std::to_string(code), "end"});
    add("CloseWithoutACode", "5.5.1, 7.1.5", frame(kClose, ""), {"close 0 | close 1000", "end"});
    add("CloseOfOneByte", "5.5.1 (a 2-byte integer)", frame(kClose, "\x03"), {"close 1002", "end"});
    add("CloseWithAReason", "5.5.1", frame(kClose, close_payload(1000, "good bye")), {"close 1000", "end"});
    add("CloseWithTheLongestReason", "5.5, 5.5.1", frame(kClose, close_payload(1000, std::string(123, 'r'))),
        {"close 1000", "end"});
    add("CloseWithAReasonTooLong", "5.5 (125 bytes or less)", frame(kClose, close_payload(1000, std::string(124, 'r'))),
        {"close 1002", "end"});
    add("CloseWithAReasonThatIsNotUtf8", "5.5.1, 8.1", frame(kClose, close_payload(1000, "\xed\xa0\x80")),
        {"close 1007 | close 1002", "end"});
    add("CloseWithAReasonThatEndsInsideACharacter", "5.5.1, 8.1", frame(kClose, close_payload(1000, "caf\xc3")),
        {"close 1007 | close 1002", "end"});
    const std::string request = echo_request("Hello");
    FrameShape unfinished;
    unfinished.fin = false;
    add("CloseInsideAMessage", "5.4, 5.5.1",
        frame(kText, request.substr(0, 9), unfinished) + frame(kClose, close_payload(1000)), {"close 1000", "end"});
    add("DataAfterClose", "5.5.1 (must not be sent), 1.4", frame(kClose, close_payload(1000)) + frame(kText, request),
        {"close 1000", "end"});
    add("APingAfterClose", "5.5.2 (no answer needed), 1.4", frame(kClose, close_payload(1000)) + frame(kPing, "late"),
        {"close 1000", "end"});
    add("CloseTwice", "5.5.1, 1.4", frame(kClose, close_payload(1000)) + frame(kClose, close_payload(1001)),
        {"close 1000", "end"});
    add("AnAnswerThenClose", "1.4, 7.1.2", frame(kText, request) + frame(kClose, close_payload(1000)),
        {"echo Hello | close 1000", "close 1000 | end"});
    cases.push_back({"TheServerClosesTcpFirst",
                     "7.1.1",
                     Stage::joined,
                     {{frame(kClose, close_payload(1000))}},
                     {"close 1000", "end"}});
    cases.push_back({"EndWithoutClose", "7.1.5 (1006), 7.2.2", Stage::joined, {{"", Step::How::finish}}, {"end"}});
    cases.push_back({"EndInsideAFrameHeader",
                     "7.1.7, 7.2.2",
                     Stage::joined,
                     {{frame(kText, echo_request(std::string(300, 'x'))).substr(0, 3)}, {"", Step::How::finish}},
                     {"end"}});
    cases.push_back({"EndInsideAPayload",
                     "7.1.7, 7.2.2",
                     Stage::joined,
                     {{frame(kText, request).substr(0, 25)}, {"", Step::How::finish}},
                     {"end"}});
    cases.push_back({"EndBetweenFragments",
                     "7.1.7, 7.2.2",
                     Stage::joined,
                     {{frame(kText, request, unfinished)}, {"", Step::How::finish}},
                     {"end"}});
    cases.push_back({"CloseBeforeIdentify",
                     "5.5.1",
                     Stage::upgraded,
                     {{frame(kClose, close_payload(1001))}},
                     {"close 1001", "end"}});
    cases.push_back({"EndBeforeIdentify", "7.2.2", Stage::upgraded, {{"", Step::How::finish}}, {"end"}});
    return cases;
}

}  // namespace gonio::conformance
