#include "fw_record.h"

#include <string.h>

void fw_record_tick(fw_core *core, const fw_record_in *in, fw_record_out *out)
{
    memset(out, 0, sizeof *out);
    const uint32_t size = in->received_size;
    fw_receive(core, in->received, size < FW_RECORD_RECEIVED ? size : FW_RECORD_RECEIVED);
    fw_tick(core, &in->inputs, &out->outputs);
    out->sent_size = (uint32_t)fw_take(core, out->sent, FW_RECORD_SENT);
    out->phase = (uint8_t)fw_phase(core);
    out->cause = (uint8_t)fw_cause(core);
    out->home_result = (uint8_t)fw_home_result(core);
}
