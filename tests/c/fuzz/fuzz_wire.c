/* Any bytes as frames and as payloads; a message packs to the same bytes again and again,
 * but for reserved bytes, which are written as 0. */
#include "input.h"
#include "sc_wire.h"

static size_t packed_again(const uint8_t *payload, size_t size, uint8_t *again)
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
    if (sc_unpack_state(payload, size, &state)) return sc_pack_state(&state, again);
    if (sc_unpack_command(payload, size, &command)) return sc_pack_command(&command, again);
    if (sc_unpack_hello(payload, size, &hello)) return sc_pack_hello(&hello, again);
    if (sc_unpack_identity(payload, size, &identity)) return sc_pack_identity(&identity, again);
    if (sc_unpack_config(payload, size, &config)) return sc_pack_config(&config, again);
    if (sc_unpack_config_echo(payload, size, &echo)) return sc_pack_config_echo(&echo, again);
    if (sc_unpack_load_begin(payload, size, &begin)) return sc_pack_load_begin(&begin, again);
    if (sc_unpack_load_chunk(payload, size, &chunk)) return sc_pack_load_chunk(&chunk, again);
    if (sc_unpack_load_commit(payload, size, &commit)) return sc_pack_load_commit(&commit, again);
    if (sc_unpack_load_echo(payload, size, &loaded)) return sc_pack_load_echo(&loaded, again);
    return 0;
}

static void hold_payload(const uint8_t *payload, size_t size)
{
    uint8_t again[SC_PAYLOAD_MAX], third[SC_PAYLOAD_MAX], frame[SC_FRAME_MAX];
    sc_decoder decoder;
    size_t taken = 0;
    const size_t whole = packed_again(payload, size, again);
    PROMISED(whole == 0 || whole == size);
    PROMISED(whole == 0 || packed_again(again, whole, third) == whole);
    PROMISED(whole == 0 || memcmp(again, third, whole) == 0);
    const size_t framed = sc_encode_frame(payload, size, frame, sizeof frame);
    PROMISED(framed == 0 || frame[framed - 1] == 0);
    if (framed == 0) return;
    PROMISED(memchr(frame, 0, framed - 1) == NULL);
    sc_decoder_init(&decoder);
    PROMISED(sc_decoder_feed(&decoder, frame, framed, &taken) == (int)size && taken == framed);
    PROMISED(memcmp(decoder.buffer, payload, size) == 0);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    sc_decoder decoder, one_by_one;
    size_t taken = 0, frames = 0, pushed = 0;
    sc_decoder_init(&decoder);
    while (taken < size) {
        const size_t before = taken;
        const int got = sc_decoder_feed(&decoder, data, size, &taken);
        PROMISED(taken <= size && (taken > before || got == 0));
        PROMISED(got >= 0 && got <= SC_PAYLOAD_MAX);
        if (got > 0) {
            uint8_t payload[SC_PAYLOAD_MAX];
            memcpy(payload, decoder.buffer, (size_t)got);
            hold_payload(payload, (size_t)got);
            frames++;
        }
    }
    sc_decoder_init(&one_by_one);
    for (size_t i = 0; i < size; i++) pushed += sc_decoder_push(&one_by_one, data[i]) > 0;
    PROMISED(pushed == frames && one_by_one.garbled == decoder.garbled);
    PROMISED(decoder.bytes_received == size);
    if (size > 0 && size <= SC_PAYLOAD_MAX) hold_payload(data, size);
    return 0;
}
