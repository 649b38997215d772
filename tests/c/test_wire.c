#include "check.h"
#include "json.h"
#include "sc_wire.h"

#include <stdlib.h>
#include <string.h>

static void check_crcs(const json *vectors)
{
    uint8_t data[512];
    const json *cases = json_get(vectors, "crc16");
    for (size_t i = 0; i < cases->size; i++) {
        const size_t size = json_bytes(json_text(&cases->items[i], "data"), data, sizeof data);
        CHECK(sc_crc16(data, size) == (uint16_t)json_number(&cases->items[i], "crc"), "crc");
    }
}

static void check_frames(const json *cases)
{
    uint8_t payload[SC_PAYLOAD_MAX], wanted[SC_FRAME_MAX], frame[SC_FRAME_MAX];
    for (size_t i = 0; i < cases->size; i++) {
        const json *one = &cases->items[i];
        const size_t size = json_bytes(json_text(one, "payload"), payload, sizeof payload);
        const size_t whole = json_bytes(json_text(one, "frame"), wanted, sizeof wanted);
        CHECK(sc_encode_frame(payload, size, frame, sizeof frame) == whole, "frame");
        CHECK(memcmp(frame, wanted, whole) == 0, "frame");
        CHECK(sc_encode_frame(payload, size, frame, size + 3) == 0, "too little room");
        sc_decoder decoder;
        size_t taken = 0;
        sc_decoder_init(&decoder);
        CHECK(sc_decoder_feed(&decoder, wanted, whole, &taken) == (int)size, "decoded");
        CHECK(taken == whole && memcmp(decoder.buffer, payload, size) == 0, "decoded");
    }
}

/* Unpack whatever type the payload has, pack it again. */
static size_t repacked(const uint8_t *payload, size_t size, uint8_t *again)
{
    sc_state state;
    sc_command command;
    sc_hello hello;
    sc_identity identity;
    sc_config config;
    sc_config_echo echo;
    sc_load_begin begin;
    sc_load_chunk chunk;
    sc_load_commit commit;
    sc_load_echo loaded;
    if (sc_unpack_state(payload, size, &state)) {
        return sc_pack_state(&state, again);
    }
    if (sc_unpack_command(payload, size, &command)) {
        return sc_pack_command(&command, again);
    }
    if (sc_unpack_hello(payload, size, &hello)) {
        return sc_pack_hello(&hello, again);
    }
    if (sc_unpack_identity(payload, size, &identity)) {
        return sc_pack_identity(&identity, again);
    }
    if (sc_unpack_config(payload, size, &config)) {
        return sc_pack_config(&config, again);
    }
    if (sc_unpack_config_echo(payload, size, &echo)) {
        return sc_pack_config_echo(&echo, again);
    }
    if (sc_unpack_load_begin(payload, size, &begin)) {
        return sc_pack_load_begin(&begin, again);
    }
    if (sc_unpack_load_chunk(payload, size, &chunk)) {
        return sc_pack_load_chunk(&chunk, again);
    }
    if (sc_unpack_load_commit(payload, size, &commit)) {
        return sc_pack_load_commit(&commit, again);
    }
    if (sc_unpack_load_echo(payload, size, &loaded)) {
        return sc_pack_load_echo(&loaded, again);
    }
    return 0;
}

static void check_messages(const json *cases)
{
    uint8_t payload[SC_PAYLOAD_MAX], again[SC_PAYLOAD_MAX];
    for (size_t i = 0; i < cases->size; i++) {
        const char *title = json_text(&cases->items[i], "title");
        const size_t size =
            json_bytes(json_text(&cases->items[i], "payload"), payload, sizeof payload);
        CHECK(repacked(payload, size, again) == size, title);
        CHECK(memcmp(payload, again, size) == 0, title);
        CHECK(repacked(payload, size - 1, again) == 0, title);
    }
}

/* The first message of the vectors, field by field: nothing may hide behind a round trip. */
static void check_state_fields(const json *cases)
{
    uint8_t payload[SC_PAYLOAD_MAX];
    sc_state state;
    const json *fields = json_get(&cases->items[0], "fields");
    const size_t size = json_bytes(json_text(&cases->items[0], "payload"), payload, sizeof payload);
    CHECK(sc_unpack_state(payload, size, &state), "state");
    CHECK(state.cause == fields->items[0].number, "state");
    CHECK(state.flags == fields->items[1].number, "state");
    CHECK(state.sequence == fields->items[2].number, "state");
    CHECK(state.device_us == fields->items[3].number, "state");
    CHECK(state.opening == (float)fields->items[4].number, "state");
    CHECK(state.advance == (float)fields->items[5].number, "state");
    CHECK(state.motor_torque == (float)fields->items[6].number, "state");
    CHECK(state.handle_force == (float)fields->items[7].number, "state");
}

static void check_streams(const json *cases)
{
    static uint8_t bytes[4096];
    uint8_t payload[SC_PAYLOAD_MAX];
    for (size_t i = 0; i < cases->size; i++) {
        const char *title = json_text(&cases->items[i], "title");
        const json *wanted = json_get(&cases->items[i], "payloads");
        const size_t size = json_bytes(json_text(&cases->items[i], "bytes"), bytes, sizeof bytes);
        size_t taken = 0, count = 0;
        int got;
        sc_decoder decoder;
        sc_decoder_init(&decoder);
        while ((got = sc_decoder_feed(&decoder, bytes, size, &taken)) > 0) {
            CHECK(count < wanted->size, title);
            if (count < wanted->size) {
                const size_t n = json_bytes(wanted->items[count].text, payload, sizeof payload);
                CHECK(n == (size_t)got && memcmp(payload, decoder.buffer, n) == 0, title);
            }
            count++;
        }
        CHECK(count == wanted->size && taken == size, title);
        CHECK(decoder.garbled == (uint32_t)json_number(&cases->items[i], "garbled"), title);
        CHECK(decoder.bytes_received == size, title);
    }
}

/* Any bytes at all: the sanitizers watch, and what comes out must encode to what went in. */
static void check_noise(void)
{
    sc_decoder decoder;
    uint32_t seed = 1;
    int sound = 0;
    sc_decoder_init(&decoder);
    for (int i = 0; i < 1000000; i++) {
        seed = seed * 1664525u + 1013904223u;
        const uint8_t byte = (uint8_t)(seed >> 24);
        if (sc_decoder_push(&decoder, byte < 16 ? 0 : (uint8_t)(byte & 7u)) > 0) {
            sound++;
        }
    }
    CHECK(sound <= 5, "noise"); /* a CRC lets 1 in 65536 of some 60000 frames pass */
    CHECK(decoder.garbled > 10000 && decoder.bytes_received == 1000000, "noise");
}

int main(int argc, char **argv)
{
    json vectors = json_load(argc > 1 ? argv[1] : "../golden", "wire.json");
    CHECK(sc_schema_hash() == strtoull(json_text(&vectors, "schema_hash"), NULL, 16), "hash");
    check_crcs(&vectors);
    check_frames(json_get(&vectors, "payloads"));
    check_frames(json_get(&vectors, "messages"));
    check_messages(json_get(&vectors, "messages"));
    check_state_fields(json_get(&vectors, "messages"));
    check_streams(json_get(&vectors, "streams"));
    check_noise();
    json_free(&vectors);
    return checks_done("wire");
}
