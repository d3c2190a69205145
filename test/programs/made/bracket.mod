MODULE Bracket
    ! upper seam of the bracket; taught 2024-03-11, checked
    PERS tooldata tTorch := [TRUE, [[0,0,250], [1,0,0,0]], [2.5,[0,0,80],[1,0,0,0],0,0,0]];
    PERS wobjdata wobjTable := [FALSE,TRUE,"",[[500,0,100],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
    CONST speeddata vWeld := [8,500,5000,1000];
    CONST seamdata sm1 := [0.2,0.05,[0,0,0,0,0,0,0,0,0],0,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0];
    CONST robtarget pStart := [[293.9788,129.7628,124.223],
        [0.00049,0.10193,-0.99438,-0.02858],  ! torch upright
        [0,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
    CONST robtarget p10:=[[413.9788,129.7628,124.223],[0.00049,0.10193,-0.99438,-0.02858],[0,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    CONST robtarget p20:=[[443.9788,159.7628,124.223],[0.00049,0.10193,-0.99438,-0.02858],[0,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    CONST robtarget p30:=[[413.9788,189.7628,124.223],[0.00049,0.10193,-0.99438,-0.02858],[0,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    LOCAL CONST jointtarget jHome := [[8,20,15,4,55,-6],[9E9,9E9,9E9,9E9,9E9,9E9]];

    PROC main()
        ConfL\On;
        MoveAbsJ jHome\NoEOffs, v200, fine, tTorch;
        MoveL Offs(pStart,0,0,50), v100, z5, tTorch\WObj:=wobjTable;
        ArcLStart pStart, v100, sm1, wd1, fine, tTorch\WObj:=wobjTable;
        ArcL p10, vWeld, sm1, wd1, z1, tTorch\WObj:=wobjTable;
        ArcC p20, p30, vWeld, sm1, wd1, z1, tTorch\WObj:=wobjTable;
        ArcLEnd [[293.9788,189.7628,124.223],[0.00049,0.10193,-0.99438,-0.02858],[0,0,-1,0],
                 [9E9,9E9,9E9,9E9,9E9,9E9]], vWeld, sm1, wd1, fine, tTorch\WObj:=wobjTable;
        WaitTime \InPos, 0.3;
        SetDO doTracker, 1;
        ! MoveL pOld, v100, fine, tTorch;
        TPWrite "MoveL p10 done";
        MoveAbsJ jHome, v200, z50, tTorch;
    ENDPROC
ENDMODULE
